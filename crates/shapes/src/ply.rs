//! PLY files, binary and as text.

use crate::mesh::{Mesh, fan, lines, number};

/// Most properties of one element: scanners write some twenty.
const MOST_PROPERTIES: usize = 100;

/// Most corners of a face.
const MOST_CORNERS: usize = 1000;

/// What the header says.
struct Header {
    format: Format,
    elements: Vec<Element>,
    /// Bytes of the header.
    length: usize,
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Text,
    LittleEndian,
    BigEndian,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    /// Type of the number of entries, where the property is a list.
    length: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// Reads the bytes of a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    let header = Header::read(bytes)?;
    let mut numbers = Numbers {
        format: header.format,
        rest: &bytes[header.length..],
    };
    let mut mesh = Mesh {
        vertices: Vec::new(),
        triangles: Ok(Vec::new()),
    };
    for element in &header.elements {
        if element.properties.is_empty() && element.count > 0 {
            return Err(format!("its element {} has no properties", element.name));
        }
        for index in 0..element.count {
            let short = || format!("it ends before {} {}", element.name, index + 1);
            match element.name.as_str() {
                "vertex" => mesh
                    .vertices
                    .push(numbers.vertex(element).ok_or_else(short)?),
                "face" => {
                    let corners = numbers.face(element).ok_or_else(short)?;
                    mesh.add_face(&corners, index + 1);
                }
                _ => numbers.skip(element).ok_or_else(short)?,
            }
        }
    }
    Ok(mesh)
}

impl Mesh {
    fn add_face(&mut self, corners: &[f64], number: usize) {
        let count = self.vertices.len() as f64;
        let is_valid = corners.len() > 2 && corners.iter().all(|c| (0.0..count).contains(c));
        if let Ok(triangles) = &mut self.triangles {
            if is_valid {
                let corners: Vec<u32> = corners.iter().map(|corner| *corner as u32).collect();
                triangles.extend(fan(&corners));
            } else {
                self.triangles = Err(format!("its face {number} has no three of its vertices"));
            }
        }
    }
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, String> {
        const END: &[u8] = b"end_header";
        let no_header = || "it has no header of a PLY file".to_owned();
        let starts = bytes.windows(END.len()).position(|window| window == END);
        let end = starts
            .filter(|_| bytes.starts_with(b"ply"))
            .ok_or_else(no_header)?;
        let mut header = Self {
            format: Format::Text,
            elements: Vec::new(),
            length: bytes.len(),
        };
        // The data begin after the line of the last word, which ends in one or two characters.
        let after = &bytes[end + END.len()..];
        if let Some(newline) = after.iter().position(|byte| *byte == b'\n') {
            header.length = end + END.len() + newline + 1;
        }
        for words in lines(&bytes[..end]) {
            let words: Vec<&str> = words
                .map(|word| std::str::from_utf8(word).unwrap_or(""))
                .collect();
            header.add(&words).ok_or_else(|| {
                format!(
                    "the line `{}` of its header cannot be read",
                    words.join(" ")
                )
            })?;
        }
        Ok(header)
    }

    /// Adds a line; `None` where it cannot be read.
    fn add(&mut self, words: &[&str]) -> Option<()> {
        match words {
            ["format", format, ..] => {
                self.format = match *format {
                    "ascii" => Format::Text,
                    "binary_little_endian" => Format::LittleEndian,
                    "binary_big_endian" => Format::BigEndian,
                    _ => return None,
                };
            }
            ["element", name, count] => self.elements.push(Element {
                name: (*name).to_owned(),
                count: count.parse().ok()?,
                properties: Vec::new(),
            }),
            ["property", "list", length, scalar, name] => {
                self.property(name, Some(Scalar::named(length)?), scalar)?;
            }
            ["property", scalar, name] => self.property(name, None, scalar)?,
            _ => {}
        }
        Some(())
    }

    fn property(&mut self, name: &str, length: Option<Scalar>, scalar: &str) -> Option<()> {
        let properties = &mut self.elements.last_mut()?.properties;
        properties.push(Property {
            name: name.to_owned(),
            length,
            scalar: Scalar::named(scalar)?,
        });
        (properties.len() <= MOST_PROPERTIES).then_some(())
    }
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// The numbers after the header, one after the other. Each is `None` at the end of the file.
struct Numbers<'a> {
    format: Format,
    rest: &'a [u8],
}

impl Numbers<'_> {
    fn next(&mut self, scalar: Scalar) -> Option<f64> {
        if self.format == Format::Text {
            let rest = self.rest.trim_ascii_start();
            let end = rest.iter().position(u8::is_ascii_whitespace);
            let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
            self.rest = rest;
            return number(Some(word));
        }
        Some(match scalar {
            Scalar::I8 => f64::from(self.bytes::<1>()?[0] as i8),
            Scalar::U8 => f64::from(self.bytes::<1>()?[0]),
            Scalar::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.bytes()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.bytes()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.bytes()?),
        })
    }

    /// Returns the next bytes, the lowest first.
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        let mut bytes = *bytes;
        if self.format == Format::BigEndian {
            bytes.reverse();
        }
        Some(bytes)
    }

    /// Returns the values of a property.
    fn values(&mut self, property: &Property) -> Option<Vec<f64>> {
        let count = match property.length {
            None => 1,
            Some(length) => self.next(length)? as usize,
        };
        if count > MOST_CORNERS {
            return None;
        }
        (0..count).map(|_| self.next(property.scalar)).collect()
    }

    fn vertex(&mut self, element: &Element) -> Option<[f32; 3]> {
        let mut vertex = [None; 3];
        for property in &element.properties {
            let values = self.values(property)?;
            if let Some(axis) = ["x", "y", "z"]
                .iter()
                .position(|axis| *axis == property.name)
            {
                vertex[axis] = values.first().copied();
            }
        }
        let [x, y, z] = vertex;
        Some([x? as f32, y? as f32, z? as f32])
    }

    fn face(&mut self, element: &Element) -> Option<Vec<f64>> {
        let mut corners = Vec::new();
        for property in &element.properties {
            let values = self.values(property)?;
            if ["vertex_indices", "vertex_index"].contains(&property.name.as_str()) {
                corners = values;
            }
        }
        Some(corners)
    }

    fn skip(&mut self, element: &Element) -> Option<()> {
        for property in &element.properties {
            self.values(property)?;
        }
        Some(())
    }
}
