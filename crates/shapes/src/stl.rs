//! STL files, binary and as text.

use crate::mesh::{Mesh, lines, unmarked, vertex};

/// Bytes of a binary file before its triangles, and of each triangle: a normal, three corners and
/// an attribute.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads the bytes of a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    let vertices = vertices(bytes)?;
    let count = vertices.len() as u32;
    let triangles = (0..count / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
    let is_whole = count.is_multiple_of(3);
    let triangles = is_whole.then(|| triangles.collect());
    Ok(Mesh {
        vertices,
        triangles: triangles.ok_or_else(|| "its last triangle lacks a corner".to_owned()),
    })
}

fn vertices(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let announced = bytes.get(80..HEADER);
    // Where a binary file has the number of its triangles, text continues.
    let is_text =
        announced.is_none_or(|bytes| bytes.iter().all(|byte| *byte >= b'\n' && byte.is_ascii()));
    let count = announced.and_then(|count| count.try_into().ok());
    let count = count.map_or(0, |count| u64::from(u32::from_le_bytes(count)));
    let room = (bytes.len().saturating_sub(HEADER) / TRIANGLE) as u64;
    if count != room || room == 0 {
        // The header of a binary file may begin with the same word.
        let begin = unmarked(bytes).trim_ascii_start().get(..5);
        return match begin.unwrap_or_default().eq_ignore_ascii_case(b"solid") {
            true => of_text(bytes),
            false if is_text => Err("it is no STL file".into()),
            false => Err(format!(
                "its header announces {count} triangles, but it has room for {room}"
            )),
        };
    }
    let (triangles, _) = bytes[HEADER..].as_chunks::<TRIANGLE>();
    let corner = |corner: &[u8; 12]| {
        let (numbers, _) = corner.as_chunks::<4>();
        [0, 1, 2].map(|k| f32::from_le_bytes(numbers[k]))
    };
    let corners = triangles
        .iter()
        .flat_map(|triangle| triangle[12..48].as_chunks::<12>().0);
    Ok(corners.map(corner).collect())
}

fn of_text(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let mut vertices = Vec::new();
    for mut words in lines(bytes) {
        if words.next() == Some(b"vertex") {
            vertices.push(vertex(words, vertices.len() + 1)?);
        }
    }
    Ok(vertices)
}
