//! Reading of an MCAP file of valid records in any order, whose numbers, positions and lengths are
//! any.
//!
//! Mutations of the bytes of a file rarely keep its lengths and its compressed chunks intact; those
//! of the records do.

use arbitrary::Arbitrary;

use crate::{logs, parsed};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Most bytes of a file, so that an execution is short.
const MOST_BYTES: usize = 1 << 18;

#[derive(Arbitrary, Debug)]
struct Input {
    records: Vec<Repeated>,
    /// Whether the file ends as a finished one, with a footer that names this position.
    summary: Option<Position>,
}

#[derive(Arbitrary, Debug)]
struct Repeated {
    record: Record,
    times: u16,
}

/// A position in the file.
#[derive(Arbitrary, Clone, Copy, Debug)]
enum Position {
    /// Of a record, counted from the beginning of the file.
    Record(u8),
    /// Where the record that names the position would end if it had this length.
    Ahead(u8),
    Any(u64),
}

#[derive(Arbitrary, Debug)]
enum Record {
    Plain(Plain),
    Chunk {
        content: Vec<Plain>,
        repeats: u16,
        is_compressed: bool,
        claimed: Option<u64>,
    },
    MessageIndex {
        channel: u8,
        times: Vec<(u16, Position)>,
    },
    ChunkIndex {
        times: (u16, u64),
        chunk: Position,
        length: Option<u64>,
        indexes: Vec<(u8, Position)>,
    },
    Metadata {
        name: Text,
        size: u16,
    },
    MetadataIndex {
        at: Position,
        length: Option<u64>,
        name: Text,
    },
    Statistics {
        counts: Vec<(u8, u64)>,
        chunks: u8,
        times: (u16, u64),
    },
    DataEnd,
}

/// A record that stands in a chunk or outside of one.
#[derive(Arbitrary, Debug)]
enum Plain {
    Schema {
        id: u8,
        name: Text,
    },
    Channel {
        id: u8,
        schema: u8,
        topic: Text,
    },
    Message {
        channel: u8,
        time: u16,
        data: Vec<u8>,
    },
    Other {
        opcode: u8,
        body: Vec<u8>,
    },
}

/// A text: one of a few that a reader knows, or any.
#[derive(Arbitrary, Debug)]
enum Text {
    Known(u8),
    Long(u16),
    Any(String),
}

impl Text {
    fn bytes(&self) -> Vec<u8> {
        const KNOWN: [&str; 6] = [
            "sensor_msgs/msg/JointState",
            "geometry_msgs/msg/WrenchStamped",
            "std_msgs/msg/String",
            "/joint_states",
            "/robot_description",
            "cdr",
        ];
        let text = match self {
            Self::Known(number) => KNOWN[usize::from(*number) % KNOWN.len()]
                .as_bytes()
                .to_vec(),
            Self::Long(length) => vec![b'a'; usize::from(*length)],
            Self::Any(text) => text.clone().into_bytes(),
        };
        prefixed(text)
    }
}

/// Checks one input.
///
/// # Panics
/// Panics if a property of [`logs::run`] does not hold.
pub fn run(bytes: &[u8]) {
    let Some(input) = parsed::<Input>(bytes) else {
        return;
    };
    let mut file = File {
        bytes: MAGIC.to_vec(),
        starts: Vec::new(),
    };
    file.add(
        0x01,
        &[prefixed(b"ros2".to_vec()), prefixed(Vec::new())].concat(),
    );
    for repeated in &input.records {
        for _ in 0..=repeated.times % 64 {
            if file.bytes.len() < MOST_BYTES {
                file.record(&repeated.record);
            }
        }
    }
    if let Some(summary) = input.summary {
        let start = file.at(summary);
        file.add(0x02, &[numbers(&[start, 0]), vec![0; 4]].concat());
        file.bytes.extend_from_slice(MAGIC);
    }
    logs::run(&file.bytes);
}

/// A file that grows by records.
struct File {
    bytes: Vec<u8>,
    /// Positions of the records.
    starts: Vec<u64>,
}

impl File {
    /// Adds a record with a body.
    fn add(&mut self, opcode: u8, body: &[u8]) {
        self.starts.push(self.bytes.len() as u64);
        self.bytes.extend(framed(opcode, body));
    }

    fn at(&self, position: Position) -> u64 {
        match position {
            Position::Record(number) => {
                let count = self.starts.len().max(1);
                self.starts
                    .get(usize::from(number) % count)
                    .copied()
                    .unwrap_or_default()
            }
            Position::Ahead(length) => self.bytes.len() as u64 + u64::from(length),
            Position::Any(at) => at,
        }
    }

    fn record(&mut self, record: &Record) {
        let (opcode, body) = match record {
            Record::Plain(plain) => plain.parts(),
            Record::Chunk {
                content,
                repeats,
                is_compressed,
                claimed,
            } => (0x06, chunk(content, *repeats, *is_compressed, *claimed)),
            Record::MessageIndex { channel, times } => {
                let times = times
                    .iter()
                    .map(|&(time, at)| numbers(&[time.into(), self.at(at)]));
                let times: Vec<Vec<u8>> = times.collect();
                (0x07, [id(*channel), prefixed(times.concat())].concat())
            }
            Record::ChunkIndex {
                times,
                chunk,
                length,
                indexes,
            } => (0x08, self.chunk_index(*times, *chunk, *length, indexes)),
            Record::Metadata { name, size } => {
                let value = prefixed(vec![b'v'; usize::from(*size)]);
                let pairs = prefixed([prefixed(b"key".to_vec()), value].concat());
                (0x0c, [name.bytes(), pairs].concat())
            }
            Record::MetadataIndex { at, length, name } => {
                let length = length.unwrap_or_else(|| self.length(*at));
                (
                    0x0d,
                    [numbers(&[self.at(*at), length]), name.bytes()].concat(),
                )
            }
            Record::Statistics {
                counts,
                chunks,
                times,
            } => (0x0b, statistics(counts, *chunks, *times)),
            Record::DataEnd => (0x0f, vec![0; 4]),
        };
        self.add(opcode, &body);
    }

    fn chunk_index(
        &self,
        times: (u16, u64),
        chunk: Position,
        length: Option<u64>,
        indexes: &[(u8, Position)],
    ) -> Vec<u8> {
        let length = length.unwrap_or_else(|| self.length(chunk));
        let indexes: Vec<Vec<u8>> = indexes
            .iter()
            .map(|&(channel, at)| [id(channel), numbers(&[self.at(at)])].concat())
            .collect();
        let start = numbers(&[times.0.into(), times.1, self.at(chunk), length]);
        let sizes = [numbers(&[0]), prefixed(b"zstd".to_vec()), numbers(&[0, 0])].concat();
        [start, prefixed(indexes.concat()), sizes].concat()
    }

    /// Returns the length of the record at a position with its opcode, or zero where there is none.
    fn length(&self, position: Position) -> u64 {
        let at = self.at(position);
        let place = self.starts.binary_search(&at);
        let next = place.ok().map(|k| {
            self.starts
                .get(k + 1)
                .copied()
                .unwrap_or(self.bytes.len() as u64)
        });
        next.map_or(0, |next| next - at)
    }
}

impl Plain {
    /// Returns opcode and body.
    fn parts(&self) -> (u8, Vec<u8>) {
        let (empty, named) = (prefixed(Vec::new()), |text: &[u8]| prefixed(text.to_vec()));
        match self {
            Self::Schema { id: number, name } => {
                let body = [id(*number), name.bytes(), named(b"ros2msg"), empty];
                (0x03, body.concat())
            }
            Self::Channel {
                id: number,
                schema,
                topic,
            } => {
                let ids = [id(*number), id(*schema)].concat();
                (0x04, [ids, topic.bytes(), named(b"cdr"), empty].concat())
            }
            Self::Message {
                channel,
                time,
                data,
            } => {
                let times = numbers(&[(*time).into(), (*time).into()]);
                let head = [id(*channel), vec![0; 4], times].concat();
                (0x05, [head, data.clone()].concat())
            }
            Self::Other { opcode, body } => (*opcode, body.clone()),
        }
    }
}

/// Returns the body of a record of statistics.
fn statistics(counts: &[(u8, u64)], chunks: u8, times: (u16, u64)) -> Vec<u8> {
    let of_channels: Vec<Vec<u8>> = counts
        .iter()
        .map(|&(channel, count)| [id(channel), numbers(&[count])].concat())
        .collect();
    let messages = counts
        .iter()
        .fold(0_u64, |sum, (_, count)| sum.wrapping_add(*count));
    // Channels, attachments, metadata records and chunks.
    let others = [1_u32, 0, 0, chunks.into()].map(u32::to_le_bytes).concat();
    let schemas = id(1);
    let times = numbers(&[times.0.into(), times.1]);
    let counted = [numbers(&[messages]), schemas, others].concat();
    [counted, times, prefixed(of_channels.concat())].concat()
}

fn chunk(content: &[Plain], repeats: u16, is_compressed: bool, claimed: Option<u64>) -> Vec<u8> {
    let framed_parts = |plain: &Plain| {
        let (opcode, body) = plain.parts();
        framed(opcode, &body)
    };
    let once: Vec<Vec<u8>> = content.iter().map(framed_parts).collect();
    let once = once.concat();
    let most = MOST_BYTES / once.len().max(1);
    let records = once.repeat((usize::from(repeats) + 1).min(most + 1));
    let packed = if is_compressed {
        zstd::encode_all(records.as_slice(), 1).expect("a compressor in memory")
    } else {
        records.clone()
    };
    let name = if is_compressed {
        b"zstd".to_vec()
    } else {
        Vec::new()
    };
    let size = claimed.unwrap_or(records.len() as u64);
    let head = [numbers(&[0, u64::MAX, size]), vec![0; 4], prefixed(name)].concat();
    [head, numbers(&[packed.len() as u64]), packed].concat()
}

/// Returns a record with its opcode and length.
fn framed(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], numbers(&[body.len() as u64]).as_slice(), body].concat()
}

/// Returns bytes with their length before them.
fn prefixed(bytes: Vec<u8>) -> Vec<u8> {
    [(bytes.len() as u32).to_le_bytes().to_vec(), bytes].concat()
}

fn id(number: u8) -> Vec<u8> {
    u16::from(number).to_le_bytes().to_vec()
}

fn numbers(all: &[u64]) -> Vec<u8> {
    all.iter().flat_map(|number| number.to_le_bytes()).collect()
}
