//! Vertices of mesh files, which are all that a convex hull needs.

/// Bytes of a binary STL file before its triangles, and of each triangle: a normal, three corners
/// and an attribute.
const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Returns the vertices in the bytes of a file. The end of its name determines the format.
///
/// # Errors
/// Returns the reason why there are none: the format, or what is wrong with the file.
pub(super) fn vertices(file: &str, bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let (_, extension) = file.rsplit_once('.').unwrap_or_default();
    match extension.to_ascii_lowercase().as_str() {
        "stl" => stl(bytes),
        "obj" => of_lines(bytes, "v"),
        _ => Err("only STL and OBJ are read".to_owned()),
    }
}

fn stl(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let count = bytes
        .get(80..STL_HEADER)
        .and_then(|count| count.try_into().ok());
    let count = count.map_or(0, |count| u64::from(u32::from_le_bytes(count)));
    let room = (bytes.len().saturating_sub(STL_HEADER) / STL_TRIANGLE) as u64;
    if count != room || room == 0 {
        // The header of a binary file may begin with the same word.
        let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        let begin = text.trim_ascii_start().get(..5).unwrap_or_default();
        return match begin.eq_ignore_ascii_case(b"solid") {
            true => of_lines(bytes, "vertex"),
            false => Err(format!(
                "its header announces {count} triangles, but it has room for {room}"
            )),
        };
    }
    let (triangles, _) = bytes[STL_HEADER..].as_chunks::<STL_TRIANGLE>();
    let corner = |corner: &[u8; 12]| {
        let (numbers, _) = corner.as_chunks::<4>();
        [0, 1, 2].map(|k| f32::from_le_bytes(numbers[k]))
    };
    let corners = triangles
        .iter()
        .flat_map(|triangle| triangle[12..48].as_chunks::<12>().0);
    Ok(corners.map(corner).collect())
}

/// Returns the three numbers that follow `keyword` on each line that begins with it.
fn of_lines(bytes: &[u8], keyword: &str) -> Result<Vec<[f32; 3]>, String> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let mut vertices = Vec::new();
    let mut number = 1;
    for line in bytes.split(|byte| matches!(byte, b'\n' | b'\r')) {
        let words = line.split(u8::is_ascii_whitespace);
        let mut words = words.filter(|word| !word.is_empty());
        if words.next() == Some(keyword.as_bytes()) {
            let mut coordinate = || std::str::from_utf8(words.next()?).ok()?.parse().ok();
            match (coordinate(), coordinate(), coordinate()) {
                (Some(x), Some(y), Some(z)) => vertices.push([x, y, z]),
                _ => return Err(format!("its vertex {number} has no three coordinates")),
            }
            number += 1;
        }
    }
    match vertices.is_empty() {
        true => Err("it has no vertices".to_owned()),
        false => Ok(vertices),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 1.0], [1.5, 0.0, 0.0], [0.0, -2.0, 3e-3]];

    /// Returns a binary STL file of one triangle, with a header that announces a number of them.
    fn binary(header: &[u8], count: u32) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(count.to_le_bytes());
        let numbers = [0.0; 3].into_iter().chain(CORNERS.into_iter().flatten());
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0, 0]);
        bytes
    }

    #[test]
    fn each_format_has_the_same_vertices() {
        let of = |name: &str, bytes: &[u8]| vertices(name, bytes).unwrap();
        assert_eq!(of("a.stl", &binary(b"", 1)), CORNERS);
        assert_eq!(of("a.STL", &binary(b"solid", 1)), CORNERS);
        let text = "solid a\r\nfacet normal 0 0 0\r\n outer loop\r\n  vertex 0 0 1\r\n  vertex 1.5 0 0\r\n\
                    \tvertex 0 -2 3e-3\r\n endloop\r\nendfacet\r\nendsolid a\r\n";
        assert_eq!(of("a.stl", text.as_bytes()), CORNERS);
        let text = text.replacen("solid", "\u{feff} SOLID", 1);
        assert_eq!(of("a.stl", text.as_bytes()), CORNERS);
        let text = "\u{feff}v 0 0 1 0.5 0.5 0.5\rvn 1 0 0\rv 1.5 0 0\rv 0 -2 3e-3\rf 1 2 3\r";
        assert_eq!(of("a.obj", text.as_bytes()), CORNERS);
    }

    #[test]
    fn a_file_without_vertices_has_a_reason() {
        let reason = |name: &str, bytes: &[u8]| vertices(name, bytes).err().unwrap();
        assert_eq!(reason("a.dae", b""), "only STL and OBJ are read");
        assert_eq!(reason("stl", b""), "only STL and OBJ are read");
        for (bytes, expected) in [
            (
                &b""[..],
                "its header announces 0 triangles, but it has room for 0",
            ),
            (
                &binary(b"", 2),
                "its header announces 2 triangles, but it has room for 1",
            ),
            (
                &binary(b"", 0),
                "its header announces 0 triangles, but it has room for 1",
            ),
            (b"solid a\nendsolid a\n", "it has no vertices"),
            (
                b"solid a\nvertex 1 2\n",
                "its vertex 1 has no three coordinates",
            ),
        ] {
            assert_eq!(reason("a.stl", bytes), expected);
        }
        let short = "its vertex 2 has no three coordinates";
        assert_eq!(reason("a.obj", b"v 1 2 3\r\nv 1 2\r\n"), short);
        assert_eq!(reason("a.obj", b"v 1 2 3\nv 1 2 x\n"), short);
        assert_eq!(reason("a.obj", b"vn 1 2 3\n"), "it has no vertices");
    }
}
