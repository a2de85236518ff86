//! The zero of each axis in the registers of the chip itself, which then gives readings without it.
//!
//! - MPU-6050, MPU-6500, MPU-9250 (`XG_OFFS_USRH` …, 16 bits): 1000/32768 °/s a step, whatever the range.
//! - ICM-426xx (`OFFSET_USER0` … of bank 4, 12 bits): 1/32 °/s a step.
//! - BMI160, BMI270 (`OFFSET_3` … `OFFSET_6`, 10 bits): 2000/32768 °/s a step (0.061).
//!
//! Each chip adds its register to the reading, so a register is the negative of what is read at rest. LSM6 parts have such registers for
//! the accelerometer alone.

use super::{
    Exported,
    autopilot::{cannot, head},
    linear::Linear,
};
use crate::model_file::ModelFile;
use anyhow::{Result, bail};
use gyro_model::Axis;
use std::{fmt::Write, str::FromStr};

/// A chip with registers for the zero of its gyro.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Chip {
    /// InvenSense MPU-6000, MPU-6050, MPU-6500
    Mpu6050,
    /// InvenSense MPU-9250
    Mpu9250,
    /// TDK ICM-42605, ICM-42670, ICM-42688
    Icm426xx,
    /// Bosch BMI160
    Bmi160,
    /// Bosch BMI270
    Bmi270,
    /// ST LSM6DS…: has none, and that is said
    Lsm6,
}

impl FromStr for Chip {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> Result<Self> {
        Ok(match name {
            "mpu6050" => Self::Mpu6050,
            "mpu9250" => Self::Mpu9250,
            "icm426xx" => Self::Icm426xx,
            "bmi160" => Self::Bmi160,
            "bmi270" => Self::Bmi270,
            "lsm6" => Self::Lsm6,
            _ => bail!("chip '{name}': expected mpu6050, mpu9250, icm426xx, bmi160, bmi270 or lsm6"),
        })
    }
}

impl Chip {
    /// Its name on the package.
    const fn name(self) -> &'static str {
        match self {
            Self::Mpu6050 => "MPU-6050",
            Self::Mpu9250 => "MPU-9250",
            Self::Icm426xx => "ICM-426xx",
            Self::Bmi160 => "BMI160",
            Self::Bmi270 => "BMI270",
            Self::Lsm6 => "LSM6",
        }
    }

    /// °/s of one step, and the largest number of steps.
    const fn step(self) -> (f64, i32) {
        match self {
            Self::Mpu6050 | Self::Mpu9250 => (1000.0 / 32768.0, 32767),
            Self::Icm426xx => (1.0 / 32.0, 2047),
            Self::Bmi160 | Self::Bmi270 | Self::Lsm6 => (2000.0 / 32768.0, 511),
        }
    }
}

/// Registers and their bytes.
///
/// # Errors
/// A chip that has none.
pub fn registers(file: &ModelFile, heading: &str, chip: Chip) -> Result<Exported> {
    if chip == Chip::Lsm6 {
        bail!(
            "an LSM6 has no register for the zero of its gyro (its X_OFS_USR … are the accelerometer's): subtract it in the firmware, \
             `--to c` writes that"
        );
    }
    let linear = Linear::of(file);
    let mut warnings = cannot(&linear, &format!("the {}", chip.name()));
    if linear.goes_by_temperature() {
        warnings.push(
            "a register cannot depend on the temperature: it is that of the middle of the temperatures of the fit"
                .into(),
        );
    }
    let range = file.provenance.as_ref().and_then(|p| p.temperature);
    let temperature = range.map_or(25.0, |(low, high)| 0.5 * (low + high));
    let (step, most) = chip.step();
    let mut steps = [0_i32; 3];
    let mut notes = Vec::new();
    for &axis in &linear.axes {
        let zero = linear.at_rest(axis.index(), temperature).to_degrees();
        let wanted = (-zero / step).round();
        let held = wanted.clamp(f64::from(-most - 1), f64::from(most));
        steps[axis.index()] = held as i32;
        let left = zero + held * step;
        if held != wanted {
            warnings.push(format!(
                "axis {axis}: a zero of {zero:.2} °/s is beyond the register, which holds {:.2} to {:.2} °/s: clipped, {left:.2} °/s are left",
                -step * f64::from(most + 1),
                step * f64::from(most)
            ));
        }
        notes.push(format!(
            "Axis {axis}: reads {zero:.4} °/s at rest; register {} ({:.4} °/s), {left:.4} °/s are left.",
            held as i32,
            held * step
        ));
    }
    let scale = format!(
        "{}: one step is {step:.5} °/s, a register holds {:.2} to {:.2} °/s. The chip adds it to the reading, so it is the negative of what \
         is read at rest.",
        chip.name(),
        -step * f64::from(most + 1),
        step * f64::from(most)
    );
    let mut all: Vec<&str> = vec![
        &scale,
        "Axes: those of the chip. Fit the model on readings that were taken with these registers at zero.",
        "Power loss clears them: write them at every start. REGISTER VALUE, hexadecimal.",
    ];
    all.extend(notes.iter().map(String::as_str));
    let mut text = head("#", heading, &warnings, &all);
    bytes(&mut text, chip, &linear.axes, steps);
    Ok(Exported { text, warnings })
}

/// The bytes, register by register; axes without a model keep what they have.
fn bytes(text: &mut String, chip: Chip, axes: &[Axis], steps: [i32; 3]) {
    let word = |axis: Axis| (steps[axis.index()] & 0xffff) as u16;
    let mut put = |register: u8, value: u16, name: &str| {
        let _ = writeln!(text, "0x{register:02X} 0x{value:02X}  # {name}");
    };
    match chip {
        Chip::Mpu6050 | Chip::Mpu9250 | Chip::Lsm6 => {
            for &axis in axes {
                let (at, letter) = (0x13 + 2 * axis.index() as u8, axis.letter().to_uppercase());
                put(at, word(axis) >> 8, &format!("{letter}G_OFFS_USRH"));
                put(at + 1, word(axis) & 0xff, &format!("{letter}G_OFFS_USRL"));
            }
        }
        Chip::Icm426xx => {
            let [x, y, z] = Axis::ALL.map(word);
            put(0x76, 4, "REG_BANK_SEL: bank 4");
            put(0x77, x & 0xff, "OFFSET_USER0: x, bits 7..0");
            put(0x78, (y >> 8 & 0xf) << 4 | x >> 8 & 0xf, "OFFSET_USER1: y and x, bits 11..8");
            put(0x79, y & 0xff, "OFFSET_USER2: y, bits 7..0");
            put(0x7a, z & 0xff, "OFFSET_USER3: z, bits 7..0");
            put(0x7b, z >> 8 & 0xf, "OFFSET_USER4: z, bits 11..8 in bits 3..0; keep bits 7..4, the accelerometer's");
            put(0x76, 0, "REG_BANK_SEL: bank 0");
        }
        Chip::Bmi160 | Chip::Bmi270 => {
            let [x, y, z] = Axis::ALL.map(word);
            put(0x74, x & 0xff, "OFFSET_3: x, bits 7..0");
            put(0x75, y & 0xff, "OFFSET_4: y, bits 7..0");
            put(0x76, z & 0xff, "OFFSET_5: z, bits 7..0");
            let high = (z >> 8 & 3) << 4 | (y >> 8 & 3) << 2 | x >> 8 & 3;
            let (on, keep) = if chip == Chip::Bmi160 {
                (0x80, "OFFSET_6: gyr_off_en (bit 7), z y x bits 9..8; keep bit 6, acc_off_en")
            } else {
                (0x40, "OFFSET_6: gyr_off_en (bit 6), z y x bits 9..8; keep bit 7, gyr_gain_en")
            };
            put(0x77, on | high, keep);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::{AxisModel, Term, effects::find};

    /// A model whose axes read these at rest, °/s.
    fn model(zeros: [f64; 3]) -> ModelFile {
        let mut file = ModelFile::default();
        for (axis, zero) in Axis::ALL.into_iter().zip(zeros) {
            let mut own = AxisModel::base(axis);
            own.terms.retain(|term| term.effect.card().id != "bias");
            own.terms.push(Term {
                effect: find("bias").unwrap(),
                values: vec![-zero.to_radians()],
                std_errors: vec![f64::NAN],
            });
            file.model.axes[axis.index()] = Some(own);
        }
        file
    }

    fn lines(zeros: [f64; 3], chip: Chip) -> (Vec<(u8, u8)>, Exported) {
        let exported = registers(&model(zeros), "Written", chip).unwrap();
        let byte = |text: &str| u8::from_str_radix(text.trim_start_matches("0x"), 16).unwrap();
        let pair = |line: &str| {
            let mut words = line.split_whitespace();
            (byte(words.next().unwrap()), byte(words.next().unwrap()))
        };
        (exported.text.lines().filter(|line| line.starts_with("0x")).map(pair).collect(), exported)
    }

    /// The signed number in the lowest bits.
    fn signed(word: u16, bits: u32) -> i32 {
        let word = i32::from(word) & ((1 << bits) - 1);
        if word >= 1 << (bits - 1) { word - (1 << bits) } else { word }
    }

    #[test]
    fn a_reading_with_its_register_added_is_zero_to_half_a_step() {
        let zeros = [3.2, -7.9, 0.02];
        let wide = |high: u8, low: u8| u16::from(high) << 8 | u16::from(low);
        let (mpu, _) = lines(zeros, Chip::Mpu6050);
        assert_eq!(mpu.iter().map(|own| own.0).collect::<Vec<_>>(), [0x13, 0x14, 0x15, 0x16, 0x17, 0x18]);
        let (icm, _) = lines(zeros, Chip::Icm426xx);
        assert_eq!((icm[0], icm[6]), ((0x76, 4), (0x76, 0)));
        let icm = [wide(icm[2].1 & 0xf, icm[1].1), wide(icm[2].1 >> 4, icm[3].1), wide(icm[5].1 & 0xf, icm[4].1)];
        let (bmi, _) = lines(zeros, Chip::Bmi160);
        assert_eq!(bmi[3].1 & 0xc0, 0x80);
        assert_eq!(lines(zeros, Chip::Bmi270).0[3].1 & 0xc0, 0x40);
        let bmi: Vec<u16> = (0..3).map(|k| wide(bmi[3].1 >> (2 * k) & 3, bmi[k].1)).collect();
        for k in 0..3 {
            let words = [
                (wide(mpu[2 * k].1, mpu[2 * k + 1].1), 16, Chip::Mpu6050),
                (icm[k], 12, Chip::Icm426xx),
                (bmi[k], 10, Chip::Bmi160),
            ];
            for (word, bits, chip) in words {
                let step = chip.step().0;
                let left = zeros[k] + f64::from(signed(word, bits)) * step;
                assert!(left.abs() <= 0.5 * step + 1e-9, "{chip:?} axis {k}: {left}");
            }
        }
    }

    #[test]
    fn what_a_register_cannot_hold_is_clipped_and_said_and_a_chip_without_one_is_refused() {
        let (bytes, exported) = lines([40.0, -40.0, 0.0], Chip::Bmi270);
        assert_eq!((signed(u16::from(bytes[3].1 & 3) << 8 | u16::from(bytes[0].1), 10)), -512);
        assert_eq!((signed(u16::from(bytes[3].1 >> 2 & 3) << 8 | u16::from(bytes[1].1), 10)), 511);
        let says = exported.warnings.join("\n");
        assert!(
            says.contains("axis x: a zero of 40.00 °/s is beyond the register") && says.contains("8.75 °/s are left"),
            "{says}"
        );
        assert!(exported.text.contains("# NOT HELD: axis y: a zero of -40.00"), "{}", exported.text);
        let refused = registers(&model([0.0; 3]), "Written", Chip::Lsm6).unwrap_err().to_string();
        assert!(
            refused.contains("has no register for the zero of its gyro") && refused.contains("--to c"),
            "{refused}"
        );
        // An axis that the model does not have is not written where it has registers of its own.
        let mut file = model([1.0; 3]);
        file.model.axes[1] = None;
        let text = registers(&file, "Written", Chip::Mpu9250).unwrap().text;
        assert!(!text.contains("YG_OFFS") && text.contains("ZG_OFFS_USRL"), "{text}");
    }
}
