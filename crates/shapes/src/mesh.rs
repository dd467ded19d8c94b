//! Meshes and point clouds in the bytes of a file.

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The vertices and the triangles of a file, in the unit of the file.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Coordinates of each vertex: there is at least one.
    pub vertices: Vec<[f32; 3]>,
    /// Vertices of each triangle, counterclockwise as seen from outside; none for a point cloud.
    /// Or the reason why they cannot be used, which does not matter to a convex hull.
    pub triangles: Result<Vec<[u32; 3]>, String>,
}

impl Mesh {
    /// Returns whether the file has points and no faces.
    #[must_use]
    pub fn is_cloud(&self) -> bool {
        self.triangles.as_ref().is_ok_and(Vec::is_empty)
    }
}

/// Returns the triangles of a polygon: a fan around its first corner.
pub(crate) fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let rest = corners.get(1..).unwrap_or_default();
    rest.windows(2).map(|pair| [corners[0], pair[0], pair[1]])
}

/// Returns bytes without a mark of their encoding.
pub(crate) fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)
}

/// Returns the words of each line of a text.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = impl Iterator<Item = &[u8]>> {
    let lines = unmarked(bytes).split(|byte| matches!(byte, b'\n' | b'\r'));
    lines.map(|line| {
        let words = line.split(u8::is_ascii_whitespace);
        words.filter(|word| !word.is_empty())
    })
}

/// Returns a number in a word.
pub(crate) fn number<T: std::str::FromStr>(word: Option<&[u8]>) -> Option<T> {
    std::str::from_utf8(word?).ok()?.parse().ok()
}

/// Returns the three coordinates of the vertex with this number, counted from one, in words.
pub(crate) fn vertex<'a>(
    mut words: impl Iterator<Item = &'a [u8]>,
    count: usize,
) -> Result<[f32; 3], String> {
    let mut coordinate = || number(words.next());
    match (coordinate(), coordinate(), coordinate()) {
        (Some(x), Some(y), Some(z)) => Ok([x, y, z]),
        _ => Err(format!("its vertex {count} has no three coordinates")),
    }
}
