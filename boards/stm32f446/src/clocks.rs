//! 180 MHz from the ST-Link's 8 MHz (UM1724, 7.7.1: MCO to OSC_IN, bypass). The fastest this part
//! goes.

use embassy_stm32::Config;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;

/// Of the timers on APB1, TIM2 among them: twice the bus (RM0390, 6.2).
pub const APB1_TIMER_HZ: u32 = 90_000_000;

/// 8 MHz / 4 * 180 / 2 = 180 MHz; APB1 45 MHz, APB2 90 MHz, their limits (DS10693, table 16).
pub fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(8_000_000),
        mode: HseMode::Bypass,
    });
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL180,
        divp: Some(PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}
