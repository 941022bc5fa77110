//! Lines of an OBJ file: as the format means them, and as tobj reads them right.

use std::io::BufRead;

/// Reads the next line into `line`, with those that continue it after a backslash. Returns how many
/// lines of the file that are: 0 at its end.
pub fn read(reader: &mut impl BufRead, line: &mut Vec<u8>) -> std::io::Result<usize> {
    line.clear();
    let mut count = 0;
    while reader.read_until(b'\n', line)? > 0 {
        count += 1;
        // A byte order mark would hide the first word.
        if line.starts_with(b"\xef\xbb\xbf") {
            line.drain(..3);
        }
        // A comment may end with the name of a folder.
        let end = line.trim_ascii_end().len();
        if !line[..end].ends_with(b"\\") || line.trim_ascii_start().starts_with(b"#") {
            break;
        }
        line.truncate(end - 1);
        line.push(b' ');
    }
    Ok(count)
}

/// Whether a line of numbers, without its end, needs neither [`read`] to join nor [`tidy`] to change it.
#[inline]
pub fn is_tidy(line: &[u8]) -> bool {
    let (mut words, mut in_word, mut plain) = (0, false, true);
    for &byte in line {
        let blank = byte.is_ascii_whitespace();
        words += usize::from(!blank && !in_word);
        in_word = !blank;
        plain &= byte.is_ascii() && byte != b'#' && byte != b'\\';
    }
    // A vertex may have a weight; more is a colour.
    plain && (words <= 5 || !line.starts_with(b"v ") && !line.starts_with(b"v\t"))
}

/// Changes what tobj misreads or refuses, without a change of meaning:
/// - A comment behind numbers goes. In names `#` is a letter: `usemtl Material #25`.
/// - Lines and points go. tobj makes triangles of a line through three points.
/// - The colour of a vertex goes. tobj refuses files in which only some vertices have one.
/// - `usemtl` begins the line, and a blank follows it: tobj takes the name from the first blank on.
pub fn tidy(line: &mut Vec<u8>) {
    let indent = line.len() - line.trim_ascii_start().len();
    if indent < line.len() {
        line.drain(..indent);
    }
    match line.split(u8::is_ascii_whitespace).next() {
        Some(b"v") => {
            cut_comment(line);
            let mut ends = (1..=line.len()).filter(|&end| {
                !line[end - 1].is_ascii_whitespace()
                    && line.get(end).is_none_or(u8::is_ascii_whitespace)
            });
            // A fourth number alone is a weight.
            if let (Some(end), Some(_)) = (ends.nth(3), ends.nth(1)) {
                cut(line, end);
            }
        }
        Some(b"vn" | b"vt" | b"f") => cut_comment(line),
        Some(b"l" | b"p") => cut(line, 0),
        Some(b"usemtl") => {
            if let Some(tab @ b'\t') = line.get_mut("usemtl".len()) {
                *tab = b' ';
            }
        }
        _ => {}
    }
}

fn cut_comment(line: &mut Vec<u8>) {
    // `-1.#IND` is how some write a number that is none.
    let begins = |w: &[u8]| w[0].is_ascii_whitespace() && w[1] == b'#';
    if line.contains(&b'#')
        && let Some(end) = line.windows(2).position(begins)
    {
        cut(line, end);
    }
}

fn cut(line: &mut Vec<u8>, end: usize) {
    line.truncate(end);
    line.push(b'\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_joined_and_counted() {
        let text = "\u{feff}f 1 \\\n 2 \\ \r\n3\n# C:\\\nv\\";
        let mut reader = text.as_bytes();
        let mut line = Vec::new();
        for (want, count) in [("f 1   2  3\n", 3), ("# C:\\\n", 1), ("v ", 1), ("", 0)] {
            assert_eq!(read(&mut reader, &mut line).unwrap(), count);
            assert_eq!(String::from_utf8_lossy(&line), want);
        }
    }

    #[test]
    fn lines_are_tidied() {
        for (line, want) in [
            ("v 1 2 3\r\n", "v 1 2 3\r\n"),
            ("v 1 2 3", "v 1 2 3"),
            ("v 1 2 3 0.5\n", "v 1 2 3 0.5\n"),
            ("v\t1  2 3 1 0 0\n", "v\t1  2 3\n"),
            (" v 1 2 3 # here\n", "v 1 2 3\n"),
            ("v 1 2 -1.#IND\n", "v 1 2 -1.#IND\n"),
            ("f 1 2 3 # here", "f 1 2 3\n"),
            ("l 1 2 3\n", "\n"),
            ("p 1", "\n"),
            ("lod 1\n", "lod 1\n"),
            ("\tusemtl\ta b #1\n", "usemtl a b #1\n"),
            ("usemtl", "usemtl"),
            ("usemtl\r\n", "usemtl\r\n"),
            ("# v 1\n", "# v 1\n"),
            ("  \n", "  \n"),
            ("", ""),
        ] {
            let mut bytes = line.as_bytes().to_vec();
            tidy(&mut bytes);
            assert_eq!(String::from_utf8_lossy(&bytes), want, "{line:?}");
            let plain = is_tidy(line.trim_end_matches('\n').as_bytes());
            let begins = matches!(line.as_bytes().first(), Some(b'v' | b'f'));
            assert!(!begins || !plain || line == want, "{line:?}");
        }
    }
}
