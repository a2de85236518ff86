//! What the columns of a text hold by their numbers, and the maps that make a log of them.

use super::{
    Maps, attitude,
    error::listed,
    gravity::share_near,
    input::Input,
    lacking::Advice,
    made_time::{self, USUAL},
    names::Names,
    sample::{FEWEST, Sample},
    unit::{self, Channel, Name},
    unsaid::{self, Open, Unit, Unsaid},
    words,
};
use crate::toml_error::quoted;
use gyro_model::{Axis, Record, Row, faults, units};
use log_readers::{
    meaning::{AXES, Pick, Proposal, defined, unit_said},
    unit::Quantity,
};
use std::io::Cursor;

/// Steps of logs, s, the usual one first, where no time is in a file: the first at which gyro and reference agree is the example.
const STEPS: [f64; 8] = [USUAL, 0.02, 0.005, 0.05, 0.002, 0.001, 0.1, 0.04];
/// Columns that are held against each other, at most.
const MOST: usize = 12;
/// How much of the angle's motion a rate has to show, as r².
const FOLLOWS: f64 = 0.9;

/// What is known of the columns already.
#[derive(Default)]
struct Used {
    time: bool,
    gyros: Vec<(Axis, usize)>,
    references: bool,
    columns: Vec<usize>,
}

impl Used {
    fn of(renamed: &[String], displaced: &[bool]) -> Self {
        let mut used = Self::default();
        for (i, name) in renamed.iter().enumerate().filter(|(i, _)| !displaced[*i]) {
            let Name::Known(channel, _) = unit::name(name) else { continue };
            used.columns.push(i);
            used.time |= channel == Channel::Time;
            used.references |= channel.is_reference();
            if let Channel::Gyro(axis) = channel {
                used.gyros.push((axis, i));
            }
        }
        used
    }
}

/// What would make a log of these columns; `wants_reference` where none comes from elsewhere.
pub fn advise(sample: &Sample, maps: &Maps, wants_reference: bool) -> Advice {
    let (first, is_open) = advise_at(sample, maps, wants_reference, USUAL);
    if !is_open || !wants_reference {
        return first;
    }
    let others = STEPS[1..].iter().map(|&step| advise_at(sample, maps, true, step));
    others.into_iter().find(|(_, is_open)| !is_open).map_or(first, |(advice, _)| advice)
}

/// The same; where no time is in it, with rows that are `step`, s, apart as an example, and whether nothing agrees with that.
fn advise_at(sample: &Sample, maps: &Maps, wants_reference: bool, step: f64) -> (Advice, bool) {
    let Ok(mut names) = Names::of(&sample.head.names, maps) else { return (Advice::default(), false) };
    let proposal = names.propose(&sample.head);
    let mut used = Used::of(&names.renamed, &names.displaced);
    used.time |= names.row_step.is_some();
    if let Some(column) = made_time::absurd(sample, &names) {
        used.time = false;
        used.columns.retain(|used| *used != column);
    }
    let mut nothing_turns = false;
    let (mut flags, mut holds, mut lacks): (Vec<Pick>, Vec<String>, Vec<&str>) = (Vec::new(), Vec::new(), Vec::new());
    let made = (!used.time).then(|| {
        let of = &used.columns;
        made_time::time(sample, of)
            .or_else(|| made_time::steps(sample, of))
            .unwrap_or_else(|| made_time::counted(sample, of, step))
    });
    let is_example = made.as_ref().is_some_and(|made| made.is_example);
    let mut is_open = is_example;
    let times = match made {
        Some(made) => {
            used.columns.extend(made.column);
            flags.push(made.pick);
            holds.push(made.says);
            Some(made.seconds)
        }
        None => made_time::known(sample, &names),
    };
    let times = times.as_deref();
    let tags: Vec<&str> = sample.texts.iter().flatten().map(String::as_str).collect();
    let angles = tags.iter().any(|tag| ["ypr", "rpy", "euler"].iter().any(|word| tag.to_lowercase().contains(word)));
    if used.gyros.is_empty() {
        let found = if angles { None } else { gyro(sample, &used, &proposal, times) };
        if let Some((picks, says)) = found {
            let gyros = gyros_of(&picks, sample);
            let has_reference = picks.iter().any(|pick| pick.name.starts_with("ref_"));
            is_open &= !has_reference;
            flags.extend(picks);
            holds.push(says);
            used.columns.extend(gyros.iter().map(|(_, column)| *column));
            let wants_one = wants_reference && !has_reference;
            if let Some((picks, says)) = wants_one.then(|| reference(sample, &used, &gyros, times)).flatten() {
                is_open = false;
                flags.extend(picks);
                holds.push(says);
            }
        } else {
            lacks.extend(is_example.then_some("time"));
            lacks.push("rate of a gyro");
        }
    } else if wants_reference && !used.references {
        let found = reference(sample, &used, &used.gyros, times);
        let offered: Vec<Pick> =
            proposal.offered.iter().filter(|pick| pick.name.starts_with("ref_")).cloned().collect();
        match (found, offered.first()) {
            (Some((picks, says)), _) => {
                is_open = false;
                flags.extend(picks);
                holds.push(says);
            }
            (None, _) if let Some((pick, says)) = wheels(sample, &used, times) => {
                is_open = false;
                flags.push(pick);
                holds.push(says);
            }
            (None, Some(first)) => {
                holds.push(may_be_reference(first, offered.len() > 1));
                // One channel a name: two of one name are two references.
                for pick in offered {
                    if flags.iter().all(|known| known.name != pick.name) {
                        flags.push(pick);
                    }
                }
            }
            (None, None) => nothing_turns = true,
        }
    }
    let mut why = if is_example && lacks.contains(&"time") { &holds[1..] } else { &holds }.join("; ");
    if !lacks.is_empty() {
        let end = if why.is_empty() { "" } else { "; " };
        why = format!("{why}{end}{}", lacking(&lacks, angles));
        flags.clear();
    }
    // Units that no reference tells.
    if flags.iter().all(|pick| !pick.name.starts_with("ref_")) && lacks.is_empty() {
        let unsaid: Vec<Pick> = flags.iter().filter(|pick| pick.name.len() == "gyro_x".len()).cloned().collect();
        let columns: Vec<(Axis, usize)> = used.gyros.clone().into_iter().chain(gyros_of(&unsaid, sample)).collect();
        if let Some(words) = words::advise(&sample.gyro_columns(&columns)) {
            let others = flags.iter().filter(|pick| !pick.name.starts_with("gyro_")).map(ToString::to_string);
            let why = [why, words.why].into_iter().filter(|why| !why.is_empty()).collect::<Vec<_>>().join("; ");
            return (Advice { why, flags: others.chain(words.flags).collect(), ..words }, is_open);
        }
    }
    let mut advice = Advice { flags: flags.iter().map(ToString::to_string).collect(), ..Advice::default() };
    if nothing_turns && lacks.is_empty() {
        let still = still(sample, &names, &used.gyros);
        (advice.needs_file, advice.at_rest) = (still.is_none(), still.is_some());
        let says = nothing_turns_with(sample, &used, still);
        why = if why.is_empty() { says } else { format!("{why}; {says}") };
    }
    (Advice { why, ..advice }, is_open)
}

fn may_be_reference(first: &Pick, are_more: bool) -> String {
    let more = if are_more { " …" } else { "" };
    format!(
        "{}{more} may be a reference, if something else than this gyro measured it (most drivers compute an orientation from the gyro)",
        quoted(&first.channel)
    )
}

/// What is said where no column turns as the gyro does, whose readings stay within `still`, rad/s, if they do.
fn nothing_turns_with(sample: &Sample, used: &Used, still: Option<f64>) -> String {
    let tried = looked_at(sample, used);
    let nothing = if tried.is_empty() {
        "no other column holds numbers that change".to_owned()
    } else {
        format!("found no column that turns as the gyro does; tried: {}", listed(&tried))
    };
    match still {
        Some(spread) => format!(
            "{nothing}; the readings stay within {}°/s of each other, as those of a sensor at rest: if it did not turn, no reference \
             is needed",
            units::round(spread.to_degrees())
        ),
        None => format!("{nothing}. Give the file that has a reference in place of REFERENCE.csv"),
    }
}

/// What is not in a text that a log needs; `angles` where only those of an attitude are in it.
fn lacking(lacks: &[&str], angles: bool) -> String {
    let but = if angles { ", only angles," } else { "" };
    let neither = match lacks {
        [one] => format!("no {one} is in it"),
        _ => format!("neither a time nor the rate of a gyro{but} is in it"),
    };
    let it = if lacks.len() > 1 { "both" } else { "it" };
    format!("{neither}: print {it} in each row, such as t_ms,gyro_x,gyro_y,gyro_z and a reference")
}

/// Columns that by their names may be a reference and hold one number throughout, while the gyros turn.
pub(super) fn motionless(sample: &Sample, maps: &Maps) -> Vec<String> {
    let Ok(mut names) = Names::of(&sample.head.names, maps) else { return Vec::new() };
    let proposal = names.propose(&sample.head);
    let used = Used::of(&names.renamed, &names.displaced);
    if used.gyros.is_empty() || still(sample, &names, &used.gyros).is_some() {
        return Vec::new();
    }
    let rests = |pick: &&Pick| {
        let column = sample.head.names.iter().position(|name| *name == pick.channel);
        column.is_some_and(|column| !sample.varies(column) && sample.values(column) >= FEWEST)
    };
    let all = || names.chosen.iter().chain(&proposal.offered).filter(|pick| pick.name.starts_with("ref_"));
    // A rotation about one axis leaves two parts of an orientation as they are.
    let is_part = |pick: &&Pick| pick.name.starts_with("ref_q");
    let whole = all().filter(is_part).all(|pick| rests(&pick));
    let still = all().filter(|pick| if is_part(pick) { whole } else { rests(pick) });
    still.map(|pick| pick.channel.clone()).collect()
}

/// The names of the columns that were held against the gyro.
fn looked_at(sample: &Sample, used: &Used) -> Vec<String> {
    let free = (0..sample.columns.len()).filter(|i| !used.columns.contains(i) && sample.varies(*i));
    free.map(|i| sample.channel(i)).collect()
}

/// What the readings of these gyros stay within, rad/s, where it is so little that the sensor may have been at rest.
fn still(sample: &Sample, names: &Names, gyros: &[(Axis, usize)]) -> Option<f64> {
    let spread = |&(_, column): &(Axis, usize)| {
        let Name::Known(channel, own) = unit::name(&names.renamed[column]) else { return f64::INFINITY };
        let scale = names.conversion(column, channel, own, &sample.head).scale;
        let mut readings: Vec<f64> = sample.columns[column].iter().copied().filter(|x| x.is_finite()).collect();
        readings.sort_by(f64::total_cmp);
        let few = readings.len() / FEW;
        readings
            .get(few)
            .zip(readings.get(readings.len().saturating_sub(few + 1)))
            .map_or(f64::INFINITY, |(low, high)| (scale * (high - low)).abs())
    };
    Some(gyros.iter().map(spread).fold(0.0, f64::max)).filter(|spread| *spread < words::RESTS.to_radians())
}

/// One in so many readings at either end is not looked at.
const FEW: usize = 500;

/// The gyro's columns among these.
fn gyros_of(picks: &[Pick], sample: &Sample) -> Vec<(Axis, usize)> {
    let of = |pick: &Pick| {
        let axis = Axis::ALL.into_iter().find(|axis| pick.name.starts_with(&format!("gyro_{axis}")))?;
        Some((axis, (0..sample.columns.len()).find(|&i| sample.channel(i) == pick.channel)?))
    };
    picks.iter().filter_map(of).collect()
}

/// Rows of which one column is a gyro's rate about z and another one its angle.
fn record(sample: &Sample, rate: &Turning, angle: &Turning, times: Option<&[f64]>) -> Record {
    let at = |k: usize| times.map_or(k as f64 * USUAL, |times| times[k]);
    let rows = (0..sample.rows()).map(|k| {
        let mut row = Row { t_ns: (at(k) * 1e9) as i64, ..Row::EMPTY };
        row.gyro[2] = rate.factor * sample.columns[rate.column][k];
        *(if angle.is_rate { &mut row.ref_rate[2] } else { &mut row.ref_angle[2] }) =
            angle.factor * sample.columns[angle.column][k];
        row
    });
    let mut rows: Vec<Row> = rows.filter(at_all).collect();
    drop_jumps(&mut rows);
    rows.sort_by_key(|row| row.t_ns);
    Record { rows, ..Record::default() }
}

/// Leaves out single rows whose time lies far from those of their neighbours: a digit of it is wrong.
fn drop_jumps(rows: &mut Vec<Row>) {
    const FAR: i64 = 10;
    let times: Vec<i64> = rows.iter().map(|row| row.t_ns).collect();
    let jumps = |k: usize| {
        let Some(&[before, own, after]) = times.get(k.wrapping_sub(1)..k + 2).and_then(|three| three.first_chunk())
        else {
            return false;
        };
        after > before && own.saturating_sub(before).saturating_abs() > FAR.saturating_mul(after - before)
    };
    let mut place = 0;
    rows.retain(|_| {
        place += 1;
        !jumps(place - 1)
    });
}

/// Whether a row has a gyro's reading or a reference.
fn at_all(row: &Row) -> bool {
    row.gyro[2].is_finite() || row.ref_angle[2].is_finite() || row.ref_rate[2].is_finite()
}

/// A column as a rate or an angle, with the unit that its name or its file says.
struct Turning {
    column: usize,
    is_rate: bool,
    said: Option<log_readers::unit::Unit>,
    /// SI units for one of its numbers, where the unit is said.
    factor: f64,
}

impl Turning {
    fn of(sample: &Sample, column: usize) -> Self {
        let head = &sample.head;
        let said = unit_said(&head.names[column], head.units[column]).or_else(|| defined(head, column));
        let said = said.filter(|unit| matches!(unit.quantity, Quantity::Rate | Quantity::Angle));
        let is_rate = said.is_some_and(|unit| unit.quantity == Quantity::Rate);
        let channel = if is_rate { Channel::RefRate(Axis::Z) } else { Channel::RefAngle(Axis::Z) };
        let factor = said.and_then(|unit| unit::converted(channel, unit)).map_or(1.0, |conversion| conversion.scale);
        Self { column, is_rate, said, factor }
    }

    /// As a pick, in the unit that is said, else in the one that was found.
    fn pick(&self, base: &str, sample: &Sample, found: Unit) -> Pick {
        self.pick_as(base, self.column, sample, found)
    }

    /// The same for a column beside it.
    fn pick_as(&self, base: &str, column: usize, sample: &Sample, found: Unit) -> Pick {
        match self.said {
            Some(unit) => Pick::new(base, &sample.channel(column), Some(unit)),
            None => sample.pick(&format!("{base}{}", found.suffix), column, found.divisor),
        }
    }
}

/// The units in which a rate and what it is held against agree, and how well they do, as r².
fn agree(sample: &Sample, rate: &Turning, other: &Turning, times: Option<&[f64]>) -> Option<Agreed> {
    let record = record(sample, rate, other, times);
    let is_open = other.said.is_none();
    let name = &sample.head.names[other.column];
    let open = Open {
        gyro: rate.said.is_none(),
        reference: if is_open { Unsaid::of(name, other.is_rate) } else { Unsaid::Nothing },
        mpu: unsaid::is_called_mpu(&sample.head.names[rate.column]) || sample.is_of_mpu(),
    };
    let told = unsaid::told(&record, Axis::Z, open)?;
    let (r2, is_other_way) = unsaid::follows(&record, told.reference).filter(|(r2, _)| *r2 > FOLLOWS)?;
    Some(Agreed { gyro: told.gyro, reference: told.reference, unsure: told.unsure(), r2, is_other_way })
}

/// How a rate and what it is held against agree.
struct Agreed {
    gyro: Unit,
    reference: Unit,
    /// What is not sure of counts.
    unsure: Option<String>,
    r2: f64,
    is_other_way: bool,
}

impl Agreed {
    /// The pick of a reference with its sign, and the words for it.
    fn signed(&self, pick: Pick) -> (Pick, &'static str) {
        if self.is_other_way {
            let factor = -pick.factor;
            (Pick { factor, ..pick }, ", counted the other way")
        } else {
            (pick, "")
        }
    }

    /// What is not sure, after what was said.
    fn unsure(&self) -> String {
        self.unsure.as_ref().map_or(String::new(), |says| format!("; {says}"))
    }
}

/// Columns that may be a gyro's, and its reference where one of the others is the integral of one.
fn gyro(sample: &Sample, used: &Used, proposal: &Proposal, times: Option<&[f64]>) -> Option<(Vec<Pick>, String)> {
    let offered: Vec<Pick> = proposal.offered.iter().filter(|pick| pick.name.starts_with("gyro_")).cloned().collect();
    if !offered.is_empty() {
        let says = offered.iter().map(|pick| quoted(&pick.channel)).collect::<Vec<_>>().join(", ");
        return Some((offered, format!("{says} may be the gyro's axes")));
    }
    let free: Vec<usize> = (0..sample.columns.len())
        .filter(|i| !used.columns.contains(i) && !sample.is_text(*i) && sample.step(*i).is_none())
        .collect();
    let moving: Vec<usize> = free.iter().copied().filter(|&i| sample.varies(i)).collect();
    if moving.len() <= MOST && times.is_some() {
        let pairs = moving.iter().flat_map(|&a| moving.iter().map(move |&b| (a, b))).filter(|(a, b)| a != b);
        let followed = pairs.filter_map(|(a, b)| {
            let (a, b) = (Turning::of(sample, a), Turning::of(sample, b));
            // An angle is no rate, and two rates do not tell which is the gyro's.
            let fits = (a.said.is_none() || a.is_rate) && !b.is_rate;
            fits.then(|| agree(sample, &a, &b, times)).flatten().map(|agreed| (agreed, a, b))
        });
        let from = |b: &Turning| std::cmp::Reverse(origin(&sample.head.names[b.column]));
        let likelier = |x: &(Agreed, Turning, Turning), y: &(Agreed, Turning, Turning)| {
            from(&x.2).cmp(&from(&y.2)).then(x.0.r2.total_cmp(&y.0.r2))
        };
        if let Some((agreed, a, b)) = followed.max_by(likelier) {
            let (reference, way) = agreed.signed(b.pick("ref_angle_z", sample, agreed.reference));
            let picks = vec![a.pick("gyro_z", sample, agreed.gyro), reference];
            let (rate, angle) = (sample.called(a.column), sample.called(b.column));
            let counts = agreed.unsure();
            let says = format!(
                "{rate} is the rate at which {angle} turns{way}: a reference, if something else than this gyro measured it{counts}"
            );
            return Some((picks, says));
        }
    }
    // Three beside each other are one sensor's axes; gravity tells an accelerometer's.
    let mut triples: Vec<usize> = (free.windows(3).enumerate())
        .filter(|(k, three)| k % 3 == 0 && three[2] == three[0] + 2)
        .map(|(_, three)| three[0])
        .collect();
    triples.retain(|&first| !is_gravity(sample, first));
    if let Some(&first) = triples.first() {
        let pick = |k: usize| Turning::of(sample, first + k).pick(&format!("gyro_{}", AXES[k]), sample, Unit::SI);
        let picks = (0..3).map(pick).collect();
        let says = format!("{} to {} may be the gyro's axes", sample.called(first), sample.called(first + 2));
        return Some((picks, says));
    }
    let [only] = moving.as_slice() else { return None };
    // A channel of a phone's attitude must not be taken for a rate.
    Some((vec![sample.pick("gyro_z", *only, 1.0)], format!("{} may be the gyro", sample.called(*only))))
}

/// Whether three columns have the length of gravity most of the time, in whatever unit.
fn is_gravity(sample: &Sample, first: usize) -> bool {
    let lengths: Vec<f64> = (0..sample.rows())
        .map(|k| (0..3).map(|i| sample.columns[first + i][k].powi(2)).sum::<f64>().sqrt())
        .filter(|x| x.is_finite())
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
    mean > 0.0 && share_near(&lengths, mean) > 0.9
}

/// What turns as the gyros do: one column, or those of an orientation.
fn reference(
    sample: &Sample,
    used: &Used,
    gyros: &[(Axis, usize)],
    times: Option<&[f64]>,
) -> Option<(Vec<Pick>, String)> {
    of_one_axis(sample, used, gyros, times).or_else(|| attitude::of(sample, &used.columns, gyros, times))
}

/// The yaw of two wheels: what the right one turns more than the left one, which a gyro shows.
fn wheels(sample: &Sample, used: &Used, times: Option<&[f64]>) -> Option<(Pick, String)> {
    let times = times?;
    let names: Vec<String> = sample.head.names.iter().map(|name| name.to_lowercase()).collect();
    let is_free = |i: &usize| !used.columns.contains(i) && sample.varies(*i);
    let pair = (0..names.len()).filter(is_free).find_map(|left| {
        let right = (0..names.len()).filter(is_free).find(|&right| is_other_side(&names[left], &names[right]))?;
        Some((left, right))
    });
    let (left, right) = pair?;
    let turned: Vec<f64> = (0..sample.rows()).map(|k| sample.columns[right][k] - sample.columns[left][k]).collect();
    let finite: Vec<f64> = turned.iter().copied().filter(|x| x.is_finite()).collect();
    let longest = finite.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    // An angle that steps by more than half a turn is taken for one that wraps.
    let small = 0.1 / longest.max(f64::MIN_POSITIVE);
    let turned = &turned;
    let tried = used.gyros.iter().flat_map(|&(axis, gyro)| {
        let rate = Turning::of(sample, gyro);
        [false, true].into_iter().filter_map(move |is_rate| {
            let rows = (0..sample.rows()).map(|k| {
                let mut row = Row { t_ns: (times[k] * 1e9) as i64, ..Row::EMPTY };
                row.gyro[axis.index()] = rate.factor * sample.columns[gyro][k];
                *(if is_rate { &mut row.ref_rate } else { &mut row.ref_angle }).get_mut(axis.index())? =
                    small * turned[k];
                Some(row)
            });
            let record = Record { rows: rows.collect::<Option<_>>()?, ..Record::default() };
            let (ratio, r2) = faults::ratio_to_reference(&record, axis)?;
            (r2 > FOLLOWS && ratio != 0.0).then_some((axis, is_rate, ratio / small, r2))
        })
    });
    let (axis, is_rate, ratio, r2) = tried.max_by(|a, b| a.3.total_cmp(&b.3))?;
    let factor: f64 = format!("{:.3e}", ratio.recip()).parse().ok()?;
    let base = if is_rate { "ref_rate" } else { "ref_angle" };
    let channel = format!("diff({},{})", sample.channel(right), sample.channel(left));
    let pick = Pick { factor, ..Pick::new(&format!("{base}_{axis}"), &channel, None) };
    let says = format!(
        "{} less {} turns as gyro_{axis} does (r² {r2:.3}): the turn of a vehicle by its two wheels. The way of a wheel in one count over \
         the track width is not in the file: {} rad is what the gyro itself says, so its scale factor cannot be found. Put your own in \
         its place",
        sample.called(right),
        sample.called(left),
        units::round(factor.abs())
    );
    Some((pick, says))
}

/// Whether two names are those of the left and the right one of two.
fn is_other_side(left: &str, right: &str) -> bool {
    let by_word = left.contains("left") && left.replacen("left", "right", 1) == right;
    let parts = |name: &str| -> Vec<String> {
        name.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty()).map(str::to_owned).collect()
    };
    let (left, right) = (parts(left), parts(right));
    let differ: Vec<(&String, &String)> = left.iter().zip(&right).filter(|(a, b)| a != b).collect();
    let is_side = |(a, b): &(&String, &String)| {
        // `l`, `ml`, `encl`: one letter says it.
        a.strip_suffix('l').is_some_and(|rest| b.strip_suffix('r') == Some(rest) && rest.len() <= 4)
            || a.strip_prefix('l').is_some_and(|rest| b.strip_prefix('r') == Some(rest) && rest.len() <= 4)
    };
    by_word || left.len() == right.len() && differ.len() == 1 && differ.iter().all(is_side)
}

/// An unused column that turns as the rate of one of the gyros has it; with the gyros in their own unit, where it is not the one that
/// their names mean.
fn of_one_axis(
    sample: &Sample,
    used: &Used,
    gyros: &[(Axis, usize)],
    times: Option<&[f64]>,
) -> Option<(Vec<Pick>, String)> {
    let free = (0..sample.columns.len()).filter(|i| !used.columns.contains(i) && sample.varies(*i));
    let mut free: Vec<usize> = free.take(MOST).collect();
    free.sort_by_key(|&column| origin(&sample.head.names[column]));
    let held =
        |gyro: usize, column: usize| agree(sample, &Turning::of(sample, gyro), &Turning::of(sample, column), times);
    let found = free.iter().enumerate().find_map(|(place, &column)| {
        let (axis, gyro, agreed) = gyros.iter().find_map(|&(axis, gyro)| Some((axis, gyro, held(gyro, column)?)))?;
        Some((place, column, axis, gyro, agreed))
    });
    let (place, column, axis, gyro, agreed) = found?;
    let (own, other) = (Turning::of(sample, gyro), Turning::of(sample, column));
    let base = if other.is_rate { "ref_rate" } else { "ref_angle" };
    let (pick, way) = agreed.signed(other.pick(&format!("{base}_{axis}"), sample, agreed.reference));
    let counts = agreed.unsure();
    let is_renamed = |axis: &Axis, column: usize| sample.head.names[column] != format!("gyro_{axis}");
    let is_meant = is_renamed(&axis, gyro) || agreed.gyro.factor == 1.0;
    let mut picks = vec![pick];
    // Of counts both factors are shown: whoever knows one of them better corrects both.
    if !is_meant || agreed.gyro.is_counts() {
        let of_sensor = gyros.iter().filter(|(axis, column)| is_meant || !is_renamed(axis, *column));
        picks
            .extend(of_sensor.map(|(axis, column)| own.pick_as(&format!("gyro_{axis}"), *column, sample, agreed.gyro)));
    }
    let unit = match agreed.gyro.suffix {
        _ if is_meant => String::new(),
        _ if agreed.gyro.is_counts() => ", if that is not in rad/s, as its name means, but in counts".to_owned(),
        "_dps" => ", if that is not in rad/s, as its name means, but in °/s".to_owned(),
        _ => ", if that is not in rad/s, as its name means".to_owned(),
    };
    let also: Vec<String> = free[place + 1..]
        .iter()
        .filter(|&&other| held(gyro, other).is_some())
        .map(|&other| sample.channel(other))
        .collect();
    let also = match also.len() {
        0 => String::new(),
        1 => format!("; so does {}", listed(&also)),
        _ => format!("; so do {}", listed(&also)),
    };
    let says = format!(
        "{} turns as gyro_{axis} does{way} (r² {:.3}){unit}: a reference, if something else than this gyro measured it{counts}{also}",
        sample.called(column),
        agreed.r2,
    );
    Some((picks, says))
}

/// How near to this gyro what is measured may come from, by its name: something else, what the name does not say, a filter of the gyro or
/// a course that a slow vehicle has none of.
fn origin(name: &str) -> u8 {
    const OTHERS: [&str; 17] = [
        "enc",
        "gnss",
        "gps",
        "hdt",
        "lighthouse",
        "mocap",
        "vicon",
        "optitrack",
        "qualisys",
        "truth",
        "ref",
        "turntable",
        "odrive",
        "vive",
        "tracker",
        "compass",
        "motor",
    ];
    const OWN: [&str; 14] = [
        "yaw", "pitch", "roll", "estimate", "kalman", "madgwick", "mahony", "fused", "filter", "ahrs", "imu", "euler",
        "course", "cog",
    ];
    let name = name.to_lowercase();
    let is = |words: &[&str]| words.iter().any(|word| name.contains(word));
    if is(&OTHERS) {
        0
    } else if is(&OWN) {
        2
    } else {
        1
    }
}

/// What may be the reference among the frames of these lines, whose signals the maps' DBC file names.
#[must_use]
pub fn advise_frames(lines: &[u8], maps: &Maps) -> Option<Advice> {
    let input = Input::of(Box::new(Cursor::new(lines.to_vec())), false).ok()?;
    let mut advice = advise(&Sample::of_messages(input, maps)?, maps, true);
    // The time of messages is known.
    advice.flags.retain(|flag| !is_of_time(flag));
    (!advice.why.is_empty()).then_some(advice)
}

/// Whether a flag names the time.
pub(super) fn is_of_time(flag: &str) -> bool {
    flag.starts_with("t=") || flag.starts_with("t_")
}
