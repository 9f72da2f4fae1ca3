//! The interrupt vectors of the part whose memory the images are linked for. cortex-m-rt has room
//! for 240 where no device crate says how many there are, half a kilobyte more than any STM32F4
//! has.

/// Of an STM32F446 (RM0390, table 38). The programs enable none.
const INTERRUPTS: usize = 97;

unsafe extern "C" {
    /// cortex-m-rt's.
    fn DefaultHandler();
}

/// The name and the section that cortex-m-rt's linker script looks for.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = [DefaultHandler; INTERRUPTS];
