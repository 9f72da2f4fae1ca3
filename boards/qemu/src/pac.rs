//! The few registers and interrupts of the mps2-an386 that this board uses: CMSDK timer, SP804-like
//! dual timer, CMSDK UART (Arm DDI 0479, chapters 4.4 to 4.8; base addresses from Arm DAI 0386,
//! table 3-1).

use core::cell::UnsafeCell;

/// Peripheral clock: every timer counts at this rate.
pub const CLOCK_HZ: u32 = 25_000_000;

/// One 32-bit device register.
#[repr(transparent)]
pub struct Register(UnsafeCell<u32>);

impl Register {
    /// Volatile read.
    #[inline(always)]
    pub fn read(&self) -> u32 {
        // SAFETY: a `Register` exists only inside the blocks below, at the address of a device
        // register.
        unsafe { self.0.get().read_volatile() }
    }

    /// Volatile write.
    #[inline(always)]
    pub fn write(&self, value: u32) {
        // SAFETY: as in `read`; no register of these blocks can make memory unsafe (there is no
        // DMA).
        unsafe { self.0.get().write_volatile(value) }
    }
}

// SAFETY: one core, and each access is a single load or store.
unsafe impl Sync for Register {}

/// CMSDK APB timer, 32 bits, counts down and reloads.
#[repr(C)]
pub struct Timer {
    /// Bit 0 enable, bit 3 interrupt enable.
    pub control: Register,
    /// Current count.
    pub value: Register,
    /// Value from which the count restarts after zero.
    pub reload: Register,
    /// Bit 0 reads as "interrupt pending"; written as 1 it clears it.
    pub interrupt: Register,
}

/// First half of the CMSDK APB dual timer.
#[repr(C)]
pub struct DualTimer {
    /// Start value; a write restarts the count.
    pub load: Register,
    /// Current count.
    pub value: Register,
    /// Bit 0 one-shot, bit 1 32 bits, bit 5 interrupt enable, bit 7 enable.
    pub control: Register,
    /// Any write clears the interrupt.
    pub clear: Register,
}

/// CMSDK APB watchdog: the first time-out raises the NMI, the second resets the machine.
#[repr(C)]
pub struct Watchdog {
    /// Start value; a write restarts the count.
    pub load: Register,
    /// Current count.
    pub value: Register,
    /// Bit 0 counts and raises the NMI, bit 1 lets the second time-out reset.
    pub control: Register,
    /// Any write clears the NMI and restarts the count.
    pub clear: Register,
}

/// CMSDK APB UART.
#[repr(C)]
pub struct Uart {
    /// Byte received, byte to send.
    pub data: Register,
    /// Bit 0 transmit buffer full, bit 1 receive buffer full.
    pub state: Register,
    /// Bit 0 transmit enable, bit 1 receive enable, bits 2 and 3 their interrupts.
    pub control: Register,
    /// Bit 0 transmit interrupt, bit 1 receive interrupt; written as 1 they clear.
    pub interrupt: Register,
    /// Clock divider, at least 16.
    pub divider: Register,
}

/// Free-running time base (`time`, `clock`).
pub fn timer0() -> &'static Timer {
    // SAFETY: the block stands at this address on this machine, for ever.
    unsafe { &*(0x4000_0000 as *const Timer) }
}

/// Pace of the control task.
pub fn timer1() -> &'static Timer {
    // SAFETY: as above.
    unsafe { &*(0x4000_1000 as *const Timer) }
}

/// The watchdog.
pub fn watchdog() -> &'static Watchdog {
    // SAFETY: as above.
    unsafe { &*(0x4000_8000 as *const Watchdog) }
}

/// Alarm of the time driver.
pub fn dual_timer() -> &'static DualTimer {
    // SAFETY: as above.
    unsafe { &*(0x4000_2000 as *const DualTimer) }
}

/// The serial line.
pub fn uart0() -> &'static Uart {
    // SAFETY: as above.
    unsafe { &*(0x4000_4000 as *const Uart) }
}

/// Interrupt numbers in use.
#[derive(Clone, Copy)]
#[repr(u16)]
pub enum Interrupt {
    /// A byte has arrived.
    Uart0Receive = 0,
    /// A byte has left.
    Uart0Transmit = 1,
    /// The 32-bit time base has wrapped.
    Timer0 = 8,
    /// A control period has passed.
    Timer1 = 9,
    /// The alarm is due.
    DualTimer = 10,
}

// SAFETY: the numbers are those of the vector table below.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Lets an interrupt through.
pub fn unmask(interrupt: Interrupt) {
    // SAFETY: no code here relies on an interrupt being masked; critical sections use PRIMASK.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt) }
}

/// One entry of the vector table.
pub union Vector {
    handler: unsafe extern "C" fn(),
    reserved: u32,
}

unsafe extern "C" {
    fn UART0_RX();
    fn UART0_TX();
    fn TIMER0();
    fn TIMER1();
    fn DUALTIMER();
}

/// Interrupt vectors, which cortex-m-rt (feature `device`) places behind the sixteen exceptions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [Vector; 32] = {
    let mut table = [const { Vector { reserved: 0 } }; 32];
    table[Interrupt::Uart0Receive as usize] = Vector { handler: UART0_RX };
    table[Interrupt::Uart0Transmit as usize] = Vector { handler: UART0_TX };
    table[Interrupt::Timer0 as usize] = Vector { handler: TIMER0 };
    table[Interrupt::Timer1 as usize] = Vector { handler: TIMER1 };
    table[Interrupt::DualTimer as usize] = Vector { handler: DUALTIMER };
    table
};
