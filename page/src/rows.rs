//! Rows on their way from the worker that drives to the one that learns: the time in ns, then the readings, 8 bytes each.

use gyro_model::Row;

/// Bytes of a row.
const BYTES: usize = 8 * 19;

/// Puts a row behind those that are there.
pub fn write(row: &Row, bytes: &mut Vec<u8>) {
    bytes.extend(row.t_ns.to_le_bytes());
    let three = [row.gyro, row.ref_angle, row.ref_rate, row.accel];
    let numbers = three.iter().flatten().chain(&row.ref_quaternion).chain([&row.temperature, &row.supply]);
    bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
}

/// The rows in these bytes.
pub fn read(bytes: &[u8]) -> impl Iterator<Item = Row> + '_ {
    bytes.chunks_exact(BYTES).map(|own| {
        let (words, _) = own.as_chunks::<8>();
        let number = |k: usize| f64::from_le_bytes(words[k]);
        let three = |first: usize| std::array::from_fn(|k| number(first + k));
        Row {
            t_ns: i64::from_le_bytes(words[0]),
            gyro: three(1),
            ref_angle: three(4),
            ref_rate: three(7),
            accel: three(10),
            ref_quaternion: std::array::from_fn(|k| number(13 + k)),
            temperature: number(17),
            supply: number(18),
            ..Row::EMPTY
        }
    })
}
