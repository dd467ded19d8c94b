//! OBJ files.

use crate::mesh::{Mesh, fan, lines, number, vertex};

/// Reads the bytes of a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    let mut vertices = Vec::new();
    let (mut triangles, mut faces) = (Ok(Vec::new()), 0);
    for mut words in lines(bytes) {
        match words.next() {
            Some(b"v") => vertices.push(vertex(words, vertices.len() + 1)?),
            Some(b"f") => {
                faces += 1;
                let corners: Option<Vec<u32>> =
                    words.map(|word| corner(word, vertices.len())).collect();
                match (corners.filter(|corners| corners.len() > 2), &mut triangles) {
                    (Some(corners), Ok(triangles)) => triangles.extend(fan(&corners)),
                    (None, Ok(_)) => {
                        triangles =
                            Err(format!("its face {faces} has no three vertices before it"));
                    }
                    (_, Err(_)) => {}
                }
            }
            _ => {}
        }
    }
    Ok(Mesh {
        vertices,
        triangles,
    })
}

/// Returns the index of the vertex of a corner, `vertex/texture/normal`: counted from one, or, where
/// it is negative, back from the `count` vertices so far.
fn corner(word: &[u8], count: usize) -> Option<u32> {
    let given: i64 = number(word.split(|byte| *byte == b'/').next())?;
    let index = if given < 0 {
        given + count as i64
    } else {
        given - 1
    };
    let index = u32::try_from(index).ok()?;
    ((index as usize) < count).then_some(index)
}
