//! What a file is that is not OBJ, by how it begins.

/// Ways to begin, and what they are.
const BEGINNINGS: [(&[u8], &str); 33] = [
    (b"glTF", "a binary glTF file"),
    (b"Kaydara FBX Binary", "an FBX file"),
    (b"; FBX", "an FBX file"),
    (b"ply\n", "a PLY file"),
    (b"ply\r", "a PLY file"),
    (b"OFF\n", "an OFF file"),
    (b"OFF\r", "an OFF file"),
    (b"BLENDER", "a Blender file"),
    (b"#usda", "a USD file"),
    (b"PXR-USDC", "a USD file"),
    (b"#VRML", "a VRML file"),
    (b"VOX ", "a MagicaVoxel file"),
    (b"//Maya ASCII", "a Maya file"),
    (b"\xd0\xcf\x11\xe0", "a 3ds Max or Office file"),
    (b"MM\x00", "a 3DS or TIFF file"),
    (b"MM", "a 3DS file"),
    (b"\x4c\x01", "a compiled object file"),
    (b"\x64\x86", "a compiled object file"),
    (b"\x7fELF", "a compiled object file"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"RIFF", "a WebP picture or a recording"),
    (b"II*\x00", "a TIFF picture"),
    (b"\x76\x2f\x31\x01", "an EXR picture"),
    (b"#?", "an HDR picture"),
    (b"DDS ", "a DDS picture"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a zip archive: unpack it first"),
    (b"7z\xbc\xaf", "a 7z archive: unpack it first"),
    (b"Rar!", "a RAR archive: unpack it first"),
    (b"\xfd7zXZ", "compressed by xz: unpack it first"),
    (
        b"\x28\xb5\x2f\xfd",
        "compressed by Zstandard: unpack it first",
    ),
];

/// Says what the file is that begins with `head`, if not OBJ, and what to do. `length` is the whole file's in
/// bytes.
pub fn other_than_obj(head: &[u8], length: u64) -> Option<String> {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let text = String::from_utf8_lossy(&head[..head.len().min(4096)]);
    let start = text.trim_start();
    let lower = start.to_lowercase();
    if start.starts_with("version https://git-lfs") {
        return Some(
            "is a Git LFS pointer in place of the file: fetch the file by `git lfs pull`".into(),
        );
    }
    if lower.starts_with("<!doctype html") || lower.starts_with("<html") {
        return Some("is a web page (HTML): the download went wrong".into());
    }
    let bytes: Option<[u8; 4]> = head.get(80..84).and_then(|b| b.try_into().ok());
    let stl_triangles = bytes.map_or(0, u32::from_le_bytes);
    let binary = head.iter().take(4096).any(|&b| b == 0);
    let what = if binary && stl_triangles > 0 && length == 84 + 50 * u64::from(stl_triangles)
        || start.starts_with("solid") && text.contains("facet")
    {
        "an STL file"
    } else if start.starts_with('{') && (text.contains("\"asset\"") || lower.contains("gltf")) {
        "a glTF file"
    } else if start.starts_with('{') || start.starts_with('[') {
        "a JSON file"
    } else if lower.contains("<collada") {
        "a COLLADA file"
    } else if lower.starts_with('<') {
        "an XML file"
    } else if let Some((_, what)) = BEGINNINGS.iter().find(|(b, _)| head.starts_with(b)) {
        *what
    } else if lower.starts_with("newmtl ") || lower.contains("\nnewmtl ") && !lower.contains("\nv ")
    {
        "a material file (MTL): give the OBJ file that names it"
    } else if binary {
        "binary data"
    } else {
        return None;
    };
    Some(if what.contains(": ") {
        format!("is {what}")
    } else if what.contains("picture") || what.contains("document") || what.contains("data") {
        format!("is {what}, not an OBJ file")
    } else {
        format!("is {what}, not an OBJ file: convert it, for example with Blender")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_how_they_begin() {
        let mut stl = [0; 84 + 50];
        stl[80] = 1;
        let beginnings: &[(&[u8], &str)] = &[
            (&stl[..], "STL"),
            (b"solid x\nfacet normal 0 0 1\n", "STL"),
            (b"ply\nformat ascii 1.0\n", "PLY"),
            (b"glTF\x02\0\0\0", "glTF"),
            (b"{\"asset\": {\"version\": \"2.0\"}}", "glTF"),
            (b"Kaydara FBX Binary  \0", "FBX"),
            (b"; FBX 7.3.0 project file\n", "FBX"),
            (b"\n<!DOCTYPE html><html>", "HTML"),
            (
                b"version https://git-lfs.github.com/spec/v1\noid",
                "git lfs pull",
            ),
            (b"\x89PNG\r\n", "PNG"),
            (b"PK\x03\x04", "zip"),
            (b"BLENDER-v402", "Blender"),
            (b"# x\nnewmtl a\nKd 1 1 1\n", "MTL"),
            (b"\x01\x02\0\x03", "binary"),
        ];
        for (head, word) in beginnings {
            let said = other_than_obj(head, head.len() as u64).unwrap();
            assert!(said.contains(word), "{word}: {said}");
        }
        for head in [
            &b"# Blender\nmtllib a.mtl\no Cube\nv 1 2 3\n"[..],
            b"\xef\xbb\xbfv 1 2 3\n",
            b"g solid\nv 0 0 0\n",
            b"",
        ] {
            assert_eq!(other_than_obj(head, head.len() as u64), None);
        }
    }
}
