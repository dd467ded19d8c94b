//! The formats of files.

use crate::{Mesh, obj, ply, stl};

/// Names of the formats that are read.
pub const FORMATS: &str = "STL, OBJ and PLY";

impl Mesh {
    /// Reads the bytes of a file. The end of its name determines the format.
    ///
    /// # Errors
    /// Returns the reason why there are no vertices: the format, or what is wrong with the file.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, String> {
        let (_, extension) = file.rsplit_once('.').unwrap_or_default();
        let mesh = match extension.to_ascii_lowercase().as_str() {
            "stl" => stl::read(bytes),
            "obj" => obj::read(bytes),
            "ply" => ply::read(bytes),
            _ => return Err(format!("only {FORMATS} are read")),
        }?;
        match mesh.vertices.is_empty() {
            true => Err("it has no vertices".to_owned()),
            false => Ok(mesh),
        }
    }
}

#[cfg(test)]
mod tests {
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
        let of = |name: &str, bytes: &[u8]| Mesh::read(name, bytes).unwrap().vertices;
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
        let reason = |name: &str, bytes: &[u8]| Mesh::read(name, bytes).unwrap_err();
        assert_eq!(reason("a.dae", b""), "only STL, OBJ and PLY are read");
        assert_eq!(reason("stl", b""), "only STL, OBJ and PLY are read");
        for (bytes, expected) in [
            (&b""[..], "it is no STL file"),
            (&[b'a'; 200], "it is no STL file"),
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

    /// Faces are counted from one in OBJ files, or back from the last vertex, and polygons are fans;
    /// PLY files count from zero, in any order of bytes and of elements.
    #[test]
    fn faces_are_triangles() {
        let of = |name: &str, bytes: &[u8]| Mesh::read(name, bytes).unwrap().triangles;
        let square = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/7 2//3 3 -1\n";
        let expected = Ok(vec![[0, 1, 2], [0, 2, 3]]);
        assert_eq!(of("a.obj", square), expected);
        let header = "element vertex 4\nproperty uchar red\nproperty float x\nproperty double y\n\
                      property float z\nelement edge 1\nproperty int a\nelement face 1\n\
                      property list uchar int vertex_indices\nend_header\n";
        let text = "0 0 0 0\n9 1 0 0\n0 1 1 0\n0 0 1 0\n5\n4 0 1 2 3\n";
        let ply = format!("ply\r\nformat ascii 1.0\ncomment\n{header}{text}");
        assert_eq!(of("a.ply", ply.as_bytes()), expected);
        for order in ["little", "big"] {
            let mut bytes = format!("ply\nformat binary_{order}_endian 1.0\n{header}").into_bytes();
            let mut add = |number: &[u8]| {
                let reversed = || number.iter().rev().copied().collect();
                let of_file: Vec<u8> = if order == "big" {
                    reversed()
                } else {
                    number.to_vec()
                };
                bytes.extend(of_file);
            };
            for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                add(&[7]);
                add(&(x as f32).to_le_bytes());
                add(&f64::to_le_bytes(y));
                add(&0_f32.to_le_bytes());
            }
            add(&5_i32.to_le_bytes());
            add(&[4]);
            for corner in 0..4_i32 {
                add(&corner.to_le_bytes());
            }
            let mesh = Mesh::read("a.PLY", &bytes).unwrap();
            assert_eq!(mesh.vertices[2], [1.0, 1.0, 0.0]);
            assert_eq!(mesh.triangles, expected);
            let short = Mesh::read("a.ply", &bytes[..bytes.len() - 1]).unwrap_err();
            assert_eq!(short, "it ends before face 1");
        }
    }

    /// A file with wrong faces has its vertices, and the reason why it has no triangles.
    #[test]
    fn wrong_faces_have_a_reason() {
        let reason = |name: &str, text: &str| Mesh::read(name, text.as_bytes()).unwrap().triangles;
        let short = "its face 1 has no three vertices before it";
        for face in ["f 1 2", "f 1 2 3", "f 0 1 1", "f 1 1 -3", "f 1 1 x"] {
            let found = reason("a.obj", &format!("v 0 0 0\nv 1 0 0\n{face}\nv 0 1 0\n"));
            assert_eq!(found.unwrap_err(), short, "{face}");
        }
        let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n3 0 0 1\n";
        let wrong = "its face 1 has no three of its vertices";
        assert_eq!(reason("a.ply", ply).unwrap_err(), wrong);
        let text = "solid a\nvertex 0 0 1\nvertex 0 1 0\nendsolid\n";
        assert_eq!(
            reason("a.stl", text).unwrap_err(),
            "its last triangle lacks a corner"
        );
    }

    /// What a header of a PLY file announces takes neither memory nor time.
    #[test]
    fn a_header_of_ply_is_read_with_care() {
        let reason = |text: &str| Mesh::read("a.ply", text.as_bytes()).unwrap_err();
        assert_eq!(reason("plx"), "it has no header of a PLY file");
        assert_eq!(
            reason("ply\nelement vertex 3\n"),
            "it has no header of a PLY file"
        );
        let many = "ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty float x\nend_header\n1\n";
        assert_eq!(reason(many), "it ends before vertex 1");
        let empty = "ply\nformat ascii 1.0\nelement edge 1000000000000\nend_header\n";
        assert_eq!(reason(empty), "its element edge has no properties");
        let format = "ply\nformat ternary 1.0\nend_header\n";
        assert_eq!(
            reason(format),
            "the line `format ternary 1.0` of its header cannot be read"
        );
        let none = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n";
        assert_eq!(reason(none), "it has no vertices");
    }
}
