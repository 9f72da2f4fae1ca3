//! Functions of a linked image that a function can reach: Thumb-2 branches, decoded.
//!
//! Direct calls and tail calls are `BL` and `B.W` (Armv7-M Architecture Reference Manual, A7.7.12
//! and A7.7.18); a call through a register (`BLX Rm`) is reported, since it could go anywhere.
//! Literal pools are left out by the ELF's mapping symbols `$d` and `$t` (ELF for the Arm
//! Architecture, 5.5.5).

use std::collections::{BTreeMap, BTreeSet};

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use sinew_ident::error::{Error, Result};

/// Functions and what each can branch to.
pub struct CallGraph {
    /// Start of a function to its name and its end.
    functions: BTreeMap<u64, (String, u64)>,
    code: Vec<(u64, Vec<u8>)>,
    /// Addresses at which mapping symbols say that data (true) or code (false) begins.
    map: BTreeMap<u64, bool>,
}

/// Functions that can be reached from one function.
#[derive(Clone, Debug, Default)]
pub struct Reach {
    /// Names of functions, itself included.
    pub functions: BTreeSet<String>,
    /// Functions that call through a register.
    pub indirect: BTreeSet<String>,
}

impl CallGraph {
    /// Reads an ELF image with symbols.
    ///
    /// # Errors
    /// It is none.
    pub fn read(image: &[u8]) -> Result<Self> {
        let file =
            object::File::parse(image).map_err(|e| Error::failed(format!("no image: {e}")))?;
        let mut functions = BTreeMap::new();
        let mut map = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            if name.starts_with("$d") || name.starts_with("$t") {
                map.insert(symbol.address(), name.starts_with("$d"));
            } else if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                // Bit 0 of a function's address says "Thumb".
                let start = symbol.address() & !1;
                functions.insert(start, (name.to_string(), start + symbol.size()));
            }
        }
        let text = file
            .sections()
            .filter(|s| s.name().is_ok_and(|n| n == ".text"));
        let code = text
            .filter_map(|s| Some((s.address(), s.data().ok()?.to_vec())))
            .collect();
        Ok(Self {
            functions,
            code,
            map,
        })
    }

    /// Functions whose name contains all of `parts`.
    pub fn named(&self, parts: &[&str]) -> Vec<u64> {
        let has = |name: &str| parts.iter().all(|part| name.contains(part));
        let found = self.functions.iter().filter(|(_, (name, _))| has(name));
        found.map(|(start, _)| *start).collect()
    }

    /// Everything that `from` can reach.
    pub fn reach(&self, from: u64) -> Reach {
        let mut reach = Reach::default();
        let mut waiting = vec![from];
        let mut seen = BTreeSet::new();
        while let Some(start) = waiting.pop() {
            let Some((name, end)) = self.functions.get(&start) else {
                continue;
            };
            if !seen.insert(start) {
                continue;
            }
            reach.functions.insert(name.clone());
            for branch in self.branches(start, *end) {
                match branch {
                    Branch::Register => {
                        reach.indirect.insert(name.clone());
                    }
                    // Inside the function: a jump, not a call.
                    Branch::To(target) if (start..*end).contains(&target) => {}
                    Branch::To(target) => match self.functions.range(..=target).next_back() {
                        Some((owner, (_, owner_end))) if target < *owner_end => {
                            waiting.push(*owner)
                        }
                        _ => {
                            reach
                                .functions
                                .insert(format!("{target:#x}, which is no function"));
                        }
                    },
                }
            }
        }
        reach
    }

    fn branches(&self, start: u64, end: u64) -> Vec<Branch> {
        let mut found = Vec::new();
        let mut at = start;
        while at + 1 < end {
            if self.is_data(at) {
                at += 2;
                continue;
            }
            let Some(first) = self.halfword(at) else {
                break;
            };
            // 11101, 11110, 11111: the first half of a 32-bit instruction (A5.1).
            if first >> 11 < 0b11101 {
                if first & 0xFF87 == 0x4780 {
                    found.push(Branch::Register);
                }
                at += 2;
                continue;
            }
            let Some(second) = self.halfword(at + 2) else {
                break;
            };
            if let Some(offset) = branch_offset(first, second) {
                found.push(Branch::To((at + 4).wrapping_add_signed(offset)));
            }
            at += 4;
        }
        found
    }

    fn is_data(&self, at: u64) -> bool {
        self.map
            .range(..=at)
            .next_back()
            .is_some_and(|(_, data)| *data)
    }

    fn halfword(&self, at: u64) -> Option<u16> {
        let (base, bytes) = self.code.iter().rfind(|(base, _)| *base <= at)?;
        let from = usize::try_from(at - base).ok()?;
        let pair = bytes.get(from..from + 2)?;
        Some(u16::from_le_bytes([pair[0], pair[1]]))
    }
}

enum Branch {
    To(u64),
    Register,
}

/// Offset of `BL` (T1), `B.W` (T4) or a conditional `B.W` (T3); `None` for any other instruction.
fn branch_offset(first: u16, second: u16) -> Option<i64> {
    if first >> 11 != 0b11110 || second >> 15 == 0 {
        return None;
    }
    let bit = |value: u16, n: u16| i64::from(value >> n & 1);
    let (s, j1, j2) = (bit(first, 10), bit(second, 13), bit(second, 11));
    let low = i64::from(second & 0x7FF);
    let sign = |value: i64, bits: u32| value << (64 - bits) >> (64 - bits);
    let is_wide = second >> 12 & 1 == 1;
    if is_wide {
        // I = NOT(J EOR S); imm32 = S:I1:I2:imm10:imm11:0.
        let (i1, i2) = (1 - (j1 ^ s), 1 - (j2 ^ s));
        let high = i64::from(first & 0x3FF);
        let value = s << 24 | i1 << 23 | i2 << 22 | high << 12 | low << 1;
        return Some(sign(value, 25));
    }
    // B<cond>.W: condition 111x is another instruction; BL has bit 14 set and bit 12 as well, so
    // not here.
    let condition = first >> 6 & 0xF;
    if second >> 14 & 1 == 1 || condition >= 0b1110 {
        return None;
    }
    let high = i64::from(first & 0x3F);
    let value = s << 20 | j2 << 19 | j1 << 18 | high << 12 | low << 1;
    Some(sign(value, 21))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_are_decoded_as_the_manual_has_them() {
        // From the assembler: `bl .+4`, `bl .` (offset -4), `b.w .+2052`, `beq.w .+1028`, and no
        // branches.
        assert_eq!(branch_offset(0xF000, 0xF800), Some(0));
        assert_eq!(branch_offset(0xF7FF, 0xFFFE), Some(-4));
        assert_eq!(branch_offset(0xF000, 0xBC00), Some(2048));
        assert_eq!(branch_offset(0xF000, 0x8200), Some(1024));
        assert_eq!(branch_offset(0xF8D1, 0x8000), None, "ldr.w");
        assert_eq!(branch_offset(0xF3BF, 0x8F4F), None, "dsb");
    }
}
