//! The serial line: CMSDK UART0, interrupt-driven both ways. 8 data bits, no parity, 1 stop bit.
//!
//! The handlers move single bytes between the device and two pipes; tasks only see the pipes. A
//! program binds them with [`crate::bind_uart!`], so that one without a serial line does not carry
//! the pipes.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io_async::{ErrorType, Read, Write};

use crate::pac::{self, Interrupt};

/// Line rate a real part would use; QEMU does not pace bytes, it only wants a legal divider.
const BAUD: u32 = 921_600;

const STATE_TRANSMIT_FULL: u32 = 1 << 0;
const STATE_RECEIVE_FULL: u32 = 1 << 1;
/// Transmitter, receiver and both interrupts.
const CONTROL_ALL: u32 = 0b1111;
const INTERRUPT_TRANSMIT: u32 = 1 << 0;
const INTERRUPT_RECEIVE: u32 = 1 << 1;

/// Two frames of the longest kind: the reader may be one control step late.
static RECEIVED: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();
static TO_SEND: Pipe<CriticalSectionRawMutex, 64> = Pipe::new();
static LOST: AtomicU32 = AtomicU32::new(0);

/// Points the two interrupt vectors at this driver. Once, at the top of a program.
#[macro_export]
macro_rules! bind_uart {
    () => {
        #[unsafe(no_mangle)]
        extern "C" fn UART0_RX() {
            $crate::uart::on_receive();
        }

        #[unsafe(no_mangle)]
        extern "C" fn UART0_TX() {
            $crate::uart::on_transmit();
        }
    };
}

/// Reading end. One per program.
pub struct Receiver(());
/// Writing end. One per program.
pub struct Transmitter(());

/// Starts the device. From here on nothing that arrives is missed.
pub fn init() -> (Receiver, Transmitter) {
    let uart = pac::uart0();
    uart.divider.write(pac::CLOCK_HZ / BAUD);
    uart.control.write(CONTROL_ALL);
    pac::unmask(Interrupt::Uart0Receive);
    pac::unmask(Interrupt::Uart0Transmit);
    (Receiver(()), Transmitter(()))
}

impl Receiver {
    /// Bytes dropped since start because nobody had read the earlier ones. The frames they belonged
    /// to fail their checksum.
    pub fn lost(&self) -> u32 {
        LOST.load(Ordering::Relaxed)
    }
}

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(RECEIVED.read(buffer).await)
    }
}

impl ErrorType for Transmitter {
    type Error = Infallible;
}

impl Write for Transmitter {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let taken = TO_SEND.write(bytes).await;
        // The handler sends the first byte too, so that only one place writes the data register.
        NVIC::pend(Interrupt::Uart0Transmit);
        Ok(taken)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        while is_sending() {
            embassy_futures::yield_now().await;
        }
        Ok(())
    }
}

/// Not everything has left yet.
pub fn is_sending() -> bool {
    !TO_SEND.is_empty() || pac::uart0().state.read() & STATE_TRANSMIT_FULL != 0
}

/// Body of the receive interrupt's handler.
pub fn on_receive() {
    let uart = pac::uart0();
    // Cleared before draining: a byte that comes in between raises it again. The other way round
    // its interrupt would be lost, and the line would stall for ever.
    uart.interrupt.write(INTERRUPT_RECEIVE);
    while uart.state.read() & STATE_RECEIVE_FULL != 0 {
        let byte = uart.data.read() as u8;
        if RECEIVED.try_write(&[byte]).is_err() {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Body of the transmit interrupt's handler.
pub fn on_transmit() {
    let uart = pac::uart0();
    uart.interrupt.write(INTERRUPT_TRANSMIT);
    let mut byte = [0];
    while uart.state.read() & STATE_TRANSMIT_FULL == 0 && TO_SEND.try_read(&mut byte).is_ok() {
        uart.data.write(u32::from(byte[0]));
    }
}
