//! A prediction in integers: values of sixteen bits, two in a word, sums of 32. Not printed into
//! any network; measured, to know what it would gain
//! (docs/decisions/0045-no-integer-arithmetic.md).
#![no_std]
#![forbid(unsafe_code)]

/// A dense layer, two weights in a word. Row `r` sums to `z / scale[r]`; the generator has seen to
/// it that no inputs whatever overflow the sum.
pub struct Layer<const PAIRS: usize, const OUT: usize> {
    pub rows: [[u32; PAIRS]; OUT],
    pub bias: [i32; OUT],
    /// Times 2^32, from a sum to steps of what comes next.
    pub gain: [i32; OUT],
}

/// Two neighbouring weights in one word.
pub const fn pack<const IN: usize, const PAIRS: usize, const OUT: usize>(
    weights: &[[i16; IN]; OUT],
) -> [[u32; PAIRS]; OUT] {
    let mut rows = [[0; PAIRS]; OUT];
    let mut r = 0;
    while r < OUT {
        let mut i = 0;
        while i < IN {
            rows[r][i / 2] |= (weights[r][i] as u16 as u32) << (16 * (i % 2));
            i += 1;
        }
        r += 1;
    }
    rows
}

/// `x / step` as an integer, to nearest and held within sixteen bits: a sum with 1.5 2^23 has it in
/// its last bits.
#[inline(always)]
fn integer(x: f32, steps: f32) -> i32 {
    const MAGIC: f32 = 12_582_912.0;
    let bits = (x * steps + MAGIC).to_bits() as i32;
    bits.saturating_sub(MAGIC.to_bits() as i32)
        .clamp(-32_768, 32_767)
}

/// Inputs, `steps` to one.
#[inline(always)]
pub fn pairs<const IN: usize, const PAIRS: usize>(x: &[f32; IN], steps: f32) -> [u32; PAIRS] {
    let mut pairs = [0; PAIRS];
    for (pair, x) in pairs.iter_mut().zip(x.chunks(2)) {
        for (half, x) in x.iter().enumerate() {
            *pair |= (integer(*x, steps) as u32 & 0xffff) << (16 * half);
        }
    }
    pairs
}

/// `sum + w x` of both halves. The compiler has an instruction for each half; the one for both
/// (SMLAD) it makes of no safe expression.
#[inline(always)]
fn add(sum: i32, w: u32, x: u32) -> i32 {
    let low = i32::from(w as i16) * i32::from(x as i16);
    let high = (w as i32 >> 16) * (x as i32 >> 16);
    sum.wrapping_add(low).wrapping_add(high)
}

/// The sums, `B` rows at a time, so that an input is loaded once for them.
#[inline(always)]
pub fn dense<const PAIRS: usize, const OUT: usize>(
    layer: &Layer<PAIRS, OUT>,
    x: &[u32; PAIRS],
) -> [i32; OUT] {
    const B: usize = 4;
    let mut sums = layer.bias;
    let (blocks, rest) = sums.as_chunks_mut::<B>();
    let (rows, last) = layer.rows.as_chunks::<B>();
    for (sums, rows) in blocks.iter_mut().zip(rows) {
        let mut block = *sums;
        for (i, x) in x.iter().enumerate() {
            for (sum, row) in block.iter_mut().zip(rows) {
                if let Some(w) = row.get(i) {
                    *sum = add(*sum, *w, *x);
                }
            }
        }
        *sums = block;
    }
    for (sum, row) in rest.iter_mut().zip(last) {
        for (w, x) in row.iter().zip(x) {
            *sum = add(*sum, *w, *x);
        }
    }
    sums
}

/// `sum gain / 2^32`.
#[inline(always)]
fn scaled(sum: i32, gain: i32) -> i32 {
    ((i64::from(sum) * i64::from(gain)) >> 32) as i32
}

/// An activation of every sum, as pairs.
#[inline(always)]
pub fn activate<const PAIRS: usize, const OUT: usize>(
    sums: &[i32; OUT],
    gain: &[i32; OUT],
    g: impl Fn(i32) -> u32,
) -> [u32; PAIRS] {
    let mut pairs = [0; PAIRS];
    for ((pair, sums), gain) in pairs.iter_mut().zip(sums.chunks(2)).zip(gain.chunks(2)) {
        for (half, (sum, gain)) in sums.iter().zip(gain).enumerate() {
            *pair |= g(scaled(*sum, *gain)) << (16 * half);
        }
    }
    pairs
}

/// The sums as floats.
#[inline(always)]
pub fn floats<const OUT: usize>(sums: &[i32; OUT], gain: &[f32; OUT]) -> [f32; OUT] {
    let mut y = *gain;
    for (y, sum) in y.iter_mut().zip(sums) {
        *y *= *sum as f32;
    }
    y
}

/// Rectifier.
#[inline(always)]
pub fn relu(z: i32) -> u32 {
    z.clamp(0, 32_767) as u32
}

/// tanh from 0 to 8 in steps of 1/32, 32,767 to one: 1e-4 between them.
static TANH: [i16; 257] = [
    0, 1024, 2045, 3063, 4075, 5079, 6073, 7056, 8025, 8980, 9919, 10840, 11742, 12625,
    13486, 14325, 15142, 15936, 16706, 17451, 18173, 18869, 19541, 20189, 20812, 21411, 21986, 22537,
    23065, 23570, 24053, 24515, 24955, 25375, 25775, 26156, 26518, 26863, 27190, 27501, 27796, 28075,
    28340, 28592, 28829, 29054, 29267, 29469, 29659, 29839, 30009, 30169, 30321, 30464, 30599, 30726,
    30846, 30959, 31066, 31166, 31261, 31350, 31435, 31514, 31588, 31658, 31725, 31787, 31845, 31900,
    31952, 32001, 32047, 32090, 32131, 32169, 32205, 32239, 32270, 32300, 32328, 32355, 32380, 32403,
    32425, 32446, 32465, 32483, 32500, 32516, 32531, 32546, 32559, 32572, 32583, 32595, 32605, 32615,
    32624, 32633, 32641, 32648, 32656, 32662, 32669, 32675, 32680, 32685, 32690, 32695, 32699, 32703,
    32707, 32711, 32714, 32717, 32720, 32723, 32726, 32728, 32731, 32733, 32735, 32737, 32739, 32740,
    32742, 32744, 32745, 32746, 32748, 32749, 32750, 32751, 32752, 32753, 32754, 32754, 32755, 32756,
    32757, 32757, 32758, 32758, 32759, 32759, 32760, 32760, 32761, 32761, 32761, 32762, 32762, 32762,
    32763, 32763, 32763, 32763, 32764, 32764, 32764, 32764, 32764, 32765, 32765, 32765, 32765, 32765,
    32765, 32765, 32765, 32766, 32766, 32766, 32766, 32766, 32766, 32766, 32766, 32766, 32766, 32766,
    32766, 32766, 32766, 32766, 32766, 32766, 32766, 32767, 32767, 32767, 32767, 32767, 32767, 32767,
    32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767,
    32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767,
    32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767,
    32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767, 32767,
    32767, 32767, 32767, 32767, 32767,
];

/// tanh of `z / 4096`.
#[inline(always)]
pub fn tanh(z: i32) -> u32 {
    let z = z.clamp(-32_768, 32_767);
    let sign = z >> 31;
    let size = z ^ sign;
    let place = (size >> 7) as usize;
    let (below, above) = match TANH.get(place..).and_then(<[i16]>::first_chunk) {
        Some([below, above]) => (i32::from(*below), i32::from(*above)),
        None => (0, 0),
    };
    let y = below + (((above - below) * (size & 127)) >> 7);
    (y ^ sign) as u32 & 0xffff
}
