//! Lines of an OBJ file, and the numbers in them.

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

/// The words of a line of numbers, without a comment behind them. In names `#` is a letter, and `-1.#IND` is
/// how some write a number that is none.
pub fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace()
        .take_while(|word| !word.starts_with('#'))
}

/// A number that is one, and not too large for 32 bits.
pub fn finite(word: &str) -> Option<f32> {
    word.parse().ok().filter(|x: &f32| x.is_finite())
}

/// What [`plain_numbers`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlainNumbers {
    /// How many.
    pub count: usize,
    /// Whether all are 0.
    pub zero: bool,
    /// Whether the last one is 0, or may be after rounding.
    pub last_zero: bool,
}

/// Longest plain number: longer ones may be too large or too small for 32 bits.
const LONGEST: usize = 24;

/// Counts the numbers of a line, or `None` where one of them is not plain: not of decimal digits with at most
/// a point and a negative exponent, which every reader takes, and which are finite.
#[inline]
pub fn plain_numbers(line: &[u8]) -> Option<PlainNumbers> {
    let mut found = PlainNumbers {
        count: 0,
        zero: true,
        last_zero: true,
    };
    let mut at = 0;
    loop {
        while line.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        if at == line.len() {
            return Some(found);
        }
        let start = at;
        let digits = |at: &mut usize, zero: &mut bool| {
            let first = *at;
            while let Some(digit @ b'0'..=b'9') = line.get(*at) {
                *zero &= *digit == b'0';
                *at += 1;
            }
            *at - first
        };
        if matches!(line[at], b'-' | b'+') {
            at += 1;
        }
        let mut zero = true;
        let mut any = digits(&mut at, &mut zero);
        if line.get(at) == Some(&b'.') {
            at += 1;
            any += digits(&mut at, &mut zero);
        }
        let small = matches!(line.get(at), Some(b'e' | b'E'));
        if small {
            if line.get(at + 1) != Some(&b'-') {
                return None;
            }
            at += 2;
            if digits(&mut at, &mut true) == 0 {
                return None;
            }
        }
        let ended = line.get(at).is_none_or(u8::is_ascii_whitespace);
        if any == 0 || !ended || at - start > LONGEST {
            return None;
        }
        found.count += 1;
        found.zero &= zero;
        found.last_zero = zero || small;
    }
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
    fn words_end_before_a_comment() {
        let all = |line| words(line).collect::<Vec<_>>();
        assert_eq!(all("\tv 1 -1.#IND\r\n"), ["v", "1", "-1.#IND"]);
        assert_eq!(all("f 1 2 3 # here"), ["f", "1", "2", "3"]);
    }

    #[test]
    fn plain_numbers_are_finite_and_all_others_are_looked_at() {
        for (line, count, zero, last_zero) in [
            ("", 0, true, true),
            (" 1 -2.5\t+.5 3. ", 4, false, false),
            ("0 -0.000 0.", 3, true, true),
            ("1 0\r", 2, false, true),
            ("1.5e-05 2E-7", 2, false, true),
        ] {
            let want = PlainNumbers {
                count,
                zero,
                last_zero,
            };
            assert_eq!(plain_numbers(line.as_bytes()), Some(want), "{line}");
            assert!(line.split_whitespace().all(|w| finite(w).is_some()));
        }
        for line in [
            "nan",
            "-nan(ind)",
            "1.#QNAN",
            "inf",
            "3.1+e2",
            "1e",
            "1e-",
            "1e5",
            "1e39",
            "--1",
            "1-2",
            "1,5",
            "1.2.3",
            ".",
            "-",
            "0x10",
            "1_000",
            "1 # x",
            "1\\",
            "\u{664}",
            "1000000000000000000000000000000000000000",
        ] {
            assert_eq!(plain_numbers(line.as_bytes()), None, "{line}");
        }
    }
}
