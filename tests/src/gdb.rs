//! Memory of a board in QEMU while it runs, by QEMU's GDB server (GDB manual, appendix E): what a
//! debug probe does with a real one. The machine stands still for as long as it is looked at, and
//! its clocks with it.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// A connection; the machine runs between accesses.
pub struct Gdb(UnixStream);

/// The machine, standing still until this is dropped.
pub struct Halted<'a>(&'a mut Gdb);

impl Gdb {
    /// Connects, and lets the machine run on: the server stops it for every new client.
    ///
    /// # Errors
    /// There is no server at `socket`.
    pub fn connect(socket: &Path) -> io::Result<Self> {
        let stream = UnixStream::connect(socket)?;
        let mut gdb = Self(stream);
        // Why it stands still is answered, and may be said unasked as well: both are passed over.
        gdb.send("?")?;
        gdb.packet()?;
        gdb.0.set_read_timeout(Some(Duration::from_millis(200)))?;
        while gdb.packet().is_ok() {}
        gdb.0.set_read_timeout(Some(Duration::from_secs(10)))?;
        gdb.send("c")?;
        Ok(gdb)
    }

    /// Stops the machine.
    ///
    /// # Errors
    /// The server is gone.
    pub fn halt(&mut self) -> io::Result<Halted<'_>> {
        self.0.write_all(&[3])?;
        self.packet()?;
        Ok(Halted(self))
    }

    fn send(&mut self, text: &str) -> io::Result<()> {
        let sum = text.bytes().fold(0_u8, u8::wrapping_add);
        self.0.write_all(format!("${text}#{sum:02x}").as_bytes())
    }

    /// The answer to `text`. Why the machine stands still (a packet of T or S) is said late on a
    /// busy computer, and answers nothing that is asked here.
    fn ask(&mut self, text: &str) -> io::Result<String> {
        self.send(text)?;
        loop {
            let answer = self.packet()?;
            if !answer.starts_with(['T', 'S']) {
                return Ok(answer);
            }
        }
    }

    /// The next packet; acknowledgements between packets are passed over.
    fn packet(&mut self) -> io::Result<String> {
        let mut text = String::new();
        while self.byte()? != b'$' {}
        loop {
            match self.byte()? {
                b'#' => break,
                byte => text.push(char::from(byte)),
            }
        }
        let _checksum = [self.byte()?, self.byte()?];
        self.0.write_all(b"+")?;
        Ok(text)
    }

    fn byte(&mut self) -> io::Result<u8> {
        let mut byte = [0];
        self.0.read_exact(&mut byte)?;
        Ok(byte[0])
    }
}

fn refused(answer: &str) -> io::Error {
    io::Error::other(format!("the GDB server answers {answer:?}"))
}

impl Halted<'_> {
    /// `length` bytes from `address`.
    ///
    /// # Errors
    /// The server is gone, or there is no such memory.
    pub fn read(&mut self, address: u32, length: u32) -> io::Result<Vec<u8>> {
        let answer = self.0.ask(&format!("m{address:x},{length:x}"))?;
        let digits = answer.as_bytes().chunks(2);
        let bytes = digits.map(|pair| {
            let pair = str::from_utf8(pair).map_err(|_| refused(&answer))?;
            u8::from_str_radix(pair, 16).map_err(|_| refused(&answer))
        });
        let bytes: Vec<u8> = bytes.collect::<io::Result<_>>()?;
        if bytes.len() == length as usize {
            Ok(bytes)
        } else {
            Err(refused(&answer))
        }
    }

    /// Writes `bytes` to `address`.
    ///
    /// # Errors
    /// As [`Halted::read`].
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> io::Result<()> {
        let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let answer = self
            .0
            .ask(&format!("M{address:x},{:x}:{digits}", bytes.len()))?;
        if answer == "OK" {
            Ok(())
        } else {
            Err(refused(&answer))
        }
    }

    /// `count` words from `address`.
    ///
    /// # Errors
    /// As [`Halted::read`].
    pub fn words(&mut self, address: u32, count: u32) -> io::Result<Vec<u32>> {
        let bytes = self.read(address, 4 * count)?;
        let (words, _) = bytes.as_chunks::<4>();
        Ok(words.iter().map(|word| u32::from_le_bytes(*word)).collect())
    }
}

impl Drop for Halted<'_> {
    fn drop(&mut self) {
        // A server that is gone is noticed at the next access.
        let _ = self.0.send("c");
    }
}
