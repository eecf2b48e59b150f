//! The control task on an STM32F407: TIM1 makes the PWM, TIM2 to TIM5 count the encoders, CAN1 is the bus.
//!
//! Two executors. The control task has one of its own that runs in an interrupt, so that nothing done in thread
//! mode, however long, delays a torque: thread mode is left to whatever is not urgent, here the log. One executor in
//! thread mode would do as long as every other task is known to give way within a few microseconds, which no log is.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::panic::PanicInfo;

use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::can::filter::{BankConfig, ListEntry16};
use embassy_stm32::can::{self, Can, Fifo};
use embassy_stm32::gpio::{AnyPin, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::peripherals::{CAN1, IWDG, TIM1};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::GeneralInstance4Channel;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm, SimplePwmChannel};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, Peri, bind_interrupts, interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker, Timer};
use embedded_can::ErrorKind;
use omni_embassy::constants::{DIGEST, MOTORS, PERIOD_US, POLICY, VEHICLE};
use omni_embassy::encoder::Encoder;
use omni_embassy::frames;
use omni_embassy::motor::MotorDriver;
use omni_embassy::task::{ControlTask, Status};
use static_cell::StaticCell;

/// Above what is audible, and no faster than a simple bridge switches.
const PWM: Hertz = Hertz(20_000);

const CAN_BITS_PER_S: u32 = 500_000;

/// Ten control periods: a task that hangs for longer has lost control. The oscillator behind it makes 7 to 19 ms of it.
///
/// It is not stopped by a breakpoint: the motors would keep their last duty. Who halts the chip gets a reset.
const WATCHDOG_US: u32 = 10_000;

// A tick is 1 us: a period of any whole number of microseconds is exact.
const _: () = assert!(embassy_time::TICK_HZ == 1_000_000);

type Motor = MotorDriver<SimplePwmChannel<'static, TIM1>, Output<'static>>;
type AnyEncoder = &'static mut (dyn Encoder<Error = Infallible> + Send);
type Control = ControlTask<SimplePwmChannel<'static, TIM1>, Output<'static>, AnyEncoder, Bus>;

/// A timer that counts the edges of an encoder.
struct Counter<T: GeneralInstance4Channel>(Qei<'static, T>);

impl<T: GeneralInstance4Channel> Encoder for Counter<T> {
    type Error = Infallible;

    fn count(&mut self) -> Result<u16, Infallible> {
        Ok(self.0.count())
    }
}

/// embassy-stm32 0.6 has the frames of `embedded_can`, not its `Can`: this is what is missing.
struct Bus(Can<'static>);

impl embedded_can::nb::Can for Bus {
    type Frame = can::Frame;
    type Error = ErrorKind;

    fn transmit(&mut self, frame: &can::Frame) -> nb::Result<Option<can::Frame>, ErrorKind> {
        match self.0.try_write(frame) {
            Ok(status) => Ok(status.dequeued_frame().copied()),
            Err(can::TryWriteError::Full) => Err(nb::Error::WouldBlock),
        }
    }

    fn receive(&mut self) -> nb::Result<can::Frame, ErrorKind> {
        use can::enums::{BusError, TryReadError};
        self.0.try_read().map(|envelope| envelope.frame).map_err(|error| {
            nb::Error::Other(match error {
                TryReadError::Empty => return nb::Error::WouldBlock,
                TryReadError::BusError(BusError::Stuff) => ErrorKind::Stuff,
                TryReadError::BusError(BusError::Form) => ErrorKind::Form,
                TryReadError::BusError(BusError::Acknowledge) => ErrorKind::Acknowledge,
                TryReadError::BusError(BusError::BitRecessive | BusError::BitDominant) => ErrorKind::Bit,
                TryReadError::BusError(BusError::Crc) => ErrorKind::Crc,
                TryReadError::BusError(BusError::Software) => ErrorKind::Other,
            })
        })
    }
}

bind_interrupts!(struct Interrupts {
    CAN1_TX => can::TxInterruptHandler<CAN1>;
    CAN1_RX0 => can::Rx0InterruptHandler<CAN1>;
    CAN1_RX1 => can::Rx1InterruptHandler<CAN1>;
    CAN1_SCE => can::SceInterruptHandler<CAN1>;
});

/// Runs the control task, in the interrupt of a UART that is not used.
static URGENT: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
unsafe fn UART4() {
    // SAFETY: called from the executor's interrupt alone, which `start` unmasks.
    unsafe { URGENT.on_interrupt() }
}

/// The last period's status, for who wants to know.
static STATUS: Signal<CriticalSectionRawMutex, Status> = Signal::new();

#[embassy_executor::task]
async fn control(mut task: Control, mut watchdog: IndependentWatchdog<'static, IWDG>) {
    let mut ticker = Ticker::every(Duration::from_micros(PERIOD_US.into()));
    watchdog.unleash();
    loop {
        ticker.next().await;
        STATUS.signal(task.step());
        watchdog.pet();
    }
}

/// 168 MHz from a crystal of 8 MHz; the buses at 42 and 84 MHz, the most they take.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(8_000_000),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2), // 8 MHz / 4 * 168 / 2
        divq: None,
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_stm32::init(clocks());
    defmt::info!(
        "vehicle {=str}, policy {=str}, controller {=u32:#010x}",
        VEHICLE,
        POLICY,
        DIGEST
    );

    // Motors first, and released. `ControlTask` holds them so until its first command.
    let low = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::Low, Speed::Low);
    let pwm = SimplePwm::new(
        p.TIM1,
        Some(PwmPin::new(p.PE9, OutputType::PushPull)),
        Some(PwmPin::new(p.PE11, OutputType::PushPull)),
        Some(PwmPin::new(p.PE13, OutputType::PushPull)),
        Some(PwmPin::new(p.PE14, OutputType::PushPull)),
        PWM,
        CountingMode::EdgeAlignedUp,
    )
    .split();
    let motor = |limit, mut pwm: SimplePwmChannel<'static, TIM1>, direction, enable| {
        pwm.set_duty_cycle_fully_off();
        pwm.enable();
        Motor::new(limit, pwm, low(direction), low(enable))
    };
    let motors = [
        motor(MOTORS[0], pwm.ch1, p.PE7.into(), p.PD8.into()),
        motor(MOTORS[1], pwm.ch2, p.PE8.into(), p.PD9.into()),
        motor(MOTORS[2], pwm.ch3, p.PE10.into(), p.PD10.into()),
        motor(MOTORS[3], pwm.ch4, p.PE12.into(), p.PD11.into()),
    ];

    let mut config = qei::Config::default();
    (config.ch1_pull, config.ch2_pull) = (Pull::Up, Pull::Up); // for encoders with open collectors
    macro_rules! encoder {
        ($timer:ident, $a:ident, $b:ident) => {{
            static COUNTER: StaticCell<Counter<embassy_stm32::peripherals::$timer>> = StaticCell::new();
            COUNTER.init(Counter(Qei::new(p.$timer, p.$a, p.$b, config))) as AnyEncoder
        }};
    }
    let encoders = [
        encoder!(TIM2, PA15, PB3),
        encoder!(TIM3, PB4, PB5),
        encoder!(TIM4, PD12, PD13),
        encoder!(TIM5, PA0, PA1),
    ];

    let mut bus = Can::new(p.CAN1, p.PD0, p.PD1, Interrupts);
    // Nothing but commands, of the right kind, gets as far as the three places of the hardware's queue.
    let commands = BankConfig::List16([ListEntry16::data_frames_with_id(frames::COMMAND); 4]);
    bus.modify_filters().enable_bank(0, Fifo::Fifo0, commands);
    bus.modify_config().set_bitrate(CAN_BITS_PER_S);
    bus.enable().await;

    let task = ControlTask::new(motors, encoders, Bus(bus));
    let watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
    // Below the clock and the bus, whose interrupts are short; above thread mode.
    interrupt::UART4.set_priority(Priority::P6);
    match control(task, watchdog) {
        Ok(token) => URGENT.start(interrupt::UART4).spawn(token),
        Err(_) => defmt::unreachable!("one control task, spawned once"),
    }

    loop {
        Timer::after_secs(1).await;
        let status = STATUS.wait().await;
        defmt::info!(
            "mode {=u8}, ignored {=u16}, hardware errors {=u16}, wheels {=[?]} rad/s, {=[?]} N.m",
            status.mode as u8,
            status.ignored,
            status.hardware_errors,
            status.velocity_rad_s,
            status.torque_n_m
        );
    }
}

/// Takes the torque off all motors and stays there: who repairs the vehicle can read why, and it
/// does not set off again.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    pac::GPIOD
        .bsrr()
        .write(|w| (8..12).for_each(|enable| w.set_br(enable, true)));
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    defmt::error!("{}", defmt::Display2Format(info));
    loop {
        pac::IWDG.kr().write(|w| w.set_key(pac::iwdg::vals::Key::RESET));
    }
}
