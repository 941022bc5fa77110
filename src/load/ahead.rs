//! Reading ahead: one thread reads and prepares while another parses.

use std::io::{BufRead, Read, Result};
use std::sync::mpsc::{Receiver, sync_channel};

/// Bytes handed over at once, and how many such pieces may wait.
const PIECE: usize = 1 << 18;
const PIECES: usize = 4;

/// Runs `parse` on what `reader` gives, which is read on a thread of its own; returns the reader too.
pub fn parse<R: Read + Send, T>(mut reader: R, parse: impl FnOnce(&mut Ahead) -> T) -> (T, R) {
    std::thread::scope(|scope| {
        let (sender, receiver) = sync_channel(PIECES);
        let thread = scope.spawn(move || {
            loop {
                let mut piece = Vec::with_capacity(PIECE);
                let end = match reader.by_ref().take(PIECE as u64).read_to_end(&mut piece) {
                    Ok(count) => {
                        // Nobody listens after an error in what was read.
                        count == 0 || sender.send(Ok(piece)).is_err()
                    }
                    Err(e) => {
                        let _ = sender.send(Err(e));
                        true
                    }
                };
                if end {
                    return reader;
                }
            }
        });
        let mut ahead = Ahead {
            receiver,
            piece: Vec::new(),
            at: 0,
        };
        let parsed = parse(&mut ahead);
        drop(ahead);
        (parsed, thread.join().expect("reading does not panic"))
    })
}

/// What was read ahead.
pub struct Ahead {
    receiver: Receiver<Result<Vec<u8>>>,
    piece: Vec<u8>,
    at: usize,
}

impl BufRead for Ahead {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        if self.at == self.piece.len() {
            // A closed channel is the end.
            self.piece = self.receiver.recv().unwrap_or_else(|_| Ok(Vec::new()))?;
            self.at = 0;
        }
        Ok(&self.piece[self.at..])
    }

    fn consume(&mut self, amount: usize) {
        self.at += amount;
    }
}

impl Read for Ahead {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        let mut buffer = self.fill_buf()?;
        let count = buffer.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_arrives_in_order() {
        let text: Vec<u8> = (0..3 * PIECE + 17).map(|i| (i % 251) as u8).collect();
        let ((), _) = parse(&text[..], |ahead| {
            let mut read = Vec::new();
            ahead.read_to_end(&mut read).unwrap();
            assert_eq!(read, text);
        });
        // A parser that gives up early does not wait for the rest.
        let (first, _) = parse(&text[..], |ahead| ahead.fill_buf().unwrap()[0]);
        assert_eq!(first, 0);
    }
}
