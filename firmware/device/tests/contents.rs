//! Frames that are whole, whose checksum is right, and whose contents are anything: damage that a
//! checksum cannot see is a peer that speaks another protocol, or means harm.

#[path = "../../mpc/tests/common/mod.rs"]
mod common;

use common::Random;
use serde::ser::{Serialize, SerializeTuple, Serializer};
use sinew_device::protocol::{FrameError, MAX_FRAME, ToDevice, ToHost, decode, encode};

/// Bytes that go into a frame as they are.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

/// Reads contents; true if writing them again gives the same bytes.
fn read<T>(contents: &[u8]) -> Result<bool, FrameError>
where
    T: for<'de> serde::Deserialize<'de> + Serialize,
{
    let (mut frame, mut again) = ([0; MAX_FRAME], [0; MAX_FRAME]);
    let sent = encode(&Raw(contents), &mut frame)
        .expect("the message fits")
        .to_vec();
    let (end, body) = sent.split_last().expect("a frame has an end");
    assert_eq!(*end, 0);
    let message: T = decode(&mut body.to_vec())?;
    let same = encode(&message, &mut again).expect("what was read fits") == sent;
    Ok(same)
}

#[test]
fn contents_of_any_bytes_are_read_or_refused() {
    let mut random = Random(7);
    let mut byte = |end: u32| (random.unit() * end as f32) as u32;
    let (mut taken, mut refused, mut other) = (0, 0, 0);
    for _ in 0..200_000 {
        // A message's own number first, then mostly small bytes: lengths that can be met.
        let length = byte(48) as usize;
        let mut contents = vec![byte(16) as u8];
        for _ in 0..length {
            let end = if byte(3) == 0 { 256 } else { 12 };
            contents.push(byte(end) as u8);
        }
        for result in [read::<ToDevice>(&contents), read::<ToHost>(&contents)] {
            match result {
                Ok(true) => taken += 1,
                // Numbers may be written in more bytes than they need.
                Ok(false) => other += 1,
                Err(FrameError::Content) => refused += 1,
                Err(error) => panic!("{error:?}: the frame itself is sound: {contents:?}"),
            }
        }
    }
    println!("{taken} taken, {other} in another form, {refused} refused");
    assert!(taken > 1_000, "{taken} taken: only refusals were tried");
    assert!(refused > 1_000, "{refused} refused: no damage was seen");
}
