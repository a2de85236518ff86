//! From a header's names to those of the format: maps, what is clear, units, and how the time is written.

use super::{
    Maps,
    error::Problem,
    map::{self, ROW_NUMBER},
    unit::{self, Channel, Conversion, Name},
};
use log_readers::{
    meaning::{self, Pick, Proposal},
    text::{self, Form, Head},
    unit::{Quantity, Unit},
};

/// The names of the columns on their way to those of the format.
pub struct Names<'a> {
    headers: &'a [String],
    /// Their names now.
    pub renamed: Vec<String>,
    /// Columns that a map names.
    mapped: Vec<bool>,
    /// Columns of a name that another was given.
    pub displaced: Vec<bool>,
    /// Factor and offset.
    scaled: Vec<(f64, f64)>,
    /// What was taken without being named.
    pub chosen: Vec<Pick>,
    /// The column of which the time is the sum.
    pub summed: Option<usize>,
    /// Columns of which another is taken away.
    pub less: Vec<Option<usize>>,
    /// The time from row to row, s, where the rows' numbers are the time.
    pub row_step: Option<f64>,
    /// Columns that hold no number.
    without_numbers: &'a [String],
}

impl<'a> Names<'a> {
    /// With what the maps say.
    pub fn of(headers: &'a [String], maps: &'a Maps) -> Result<Self, Problem> {
        let count = headers.len();
        let renamed = match &maps.columns {
            Some(map) => map.rename(headers)?,
            None => headers.to_vec(),
        };
        let mut names = Self {
            headers,
            renamed,
            mapped: vec![false; count],
            displaced: vec![false; count],
            scaled: vec![(1.0, 0.0); count],
            chosen: Vec::new(),
            summed: None,
            less: vec![None; count],
            row_step: None,
            without_numbers: &maps.without_numbers,
        };
        for flag in &maps.flags {
            for pick in flag.picks(headers)? {
                names.take_mapped(pick);
            }
        }
        Ok(names)
    }

    /// What a map names: a column, or a time that is made of the rows' numbers or of steps.
    fn take_mapped(&mut self, pick: Pick) {
        let is_made = !self.headers.contains(&pick.channel);
        let summed = map::summed(&pick.channel).filter(|_| is_made).map(str::to_owned);
        if is_made && pick.channel == ROW_NUMBER {
            self.row_step = seconds(&pick.name).map(|seconds| seconds * pick.factor);
            self.displace(&pick.name, None);
            return;
        }
        let is_sum = summed.is_some();
        let pair = map::difference(&pick.channel).filter(|_| is_made);
        let pair = pair.map(|(first, second)| (first.to_owned(), second.to_owned()));
        let less = pair.as_ref().and_then(|(_, second)| self.headers.iter().position(|header| header == second));
        let channel = summed.or(pair.map(|(first, _)| first)).unwrap_or(pick.channel);
        let place = self.take(&Pick { channel, ..pick });
        if let Some(place) = place {
            self.mapped[place] = true;
            self.less[place] = less;
            self.summed = if is_sum { Some(place) } else { self.summed };
        }
    }

    /// Gives a column the name that a pick has for it. What had that name before is not read.
    fn take(&mut self, pick: &Pick) -> Option<usize> {
        let untouched = |i: &usize| self.renamed[*i] == self.headers[*i];
        let mut places = (0..self.headers.len()).filter(|&i| self.headers[i] == pick.channel);
        let place = places.clone().find(untouched).or_else(|| places.next())?;
        self.displace(&pick.name, Some(place));
        self.renamed[place].clone_from(&pick.name);
        self.scaled[place] = (pick.factor, pick.offset);
        self.displaced[place] = false;
        Some(place)
    }

    /// Takes a name of the format from the columns that had it, but for one.
    fn displace(&mut self, name: &str, but: Option<usize>) {
        let channel = |name: &str| if let Name::Known(channel, _) = unit::name(name) { Some(channel) } else { None };
        for i in (0..self.renamed.len()).filter(|&i| Some(i) != but) {
            let same = channel(name).map_or(self.renamed[i] == name, |c| channel(&self.renamed[i]) == Some(c));
            self.displaced[i] |= same;
        }
    }

    /// Takes what is clear where the names of the format and the maps leave something open.
    pub fn propose(&mut self, head: &Head) -> Proposal {
        let mut known: Vec<Channel> = (self.renamed.iter().zip(&self.displaced))
            .filter_map(|(name, displaced)| match unit::name(name) {
                Name::Known(channel, _) if !displaced => Some(channel),
                _ => None,
            })
            .collect();
        known.extend(self.row_step.map(|_| Channel::Time));
        let has = |is: fn(&Channel) -> bool| known.iter().any(is);
        let complete = has(|c| *c == Channel::Time) && has(|c| matches!(c, Channel::Gyro(_)));
        let referenced = has(Channel::is_reference);
        let base = |name: &str| if let Name::Known(channel, _) = unit::name(name) { Some(channel) } else { None };
        let taken = |name: &str| match base(name) {
            Some(Channel::Gyro(_)) if has(|c| matches!(c, Channel::Gyro(_))) => true,
            Some(Channel::RefAngle(_) | Channel::RefRate(_) | Channel::Quaternion(_)) if referenced => true,
            // A log in our own names says what it means.
            Some(Channel::Time | Channel::Accel(_) | Channel::Temperature | Channel::Supply) if complete => true,
            channel => channel.is_some_and(|channel| known.contains(&channel)),
        };
        // Columns that have a meaning already are no candidates for another.
        let free: Vec<String> = (self.renamed.iter().zip(self.headers).zip(&self.mapped))
            .map(|((name, header), mapped)| {
                let is_empty = self.without_numbers.contains(header);
                if *mapped || is_empty || base(name).is_some() && name != header {
                    String::new()
                } else {
                    header.clone()
                }
            })
            .collect();
        let mut unnamed = head.clone();
        unnamed.names = free;
        let mut proposal = meaning::of_text(&unnamed, &taken);
        proposal.dependent = meaning::of_text(head, &|_| true).dependent;
        for pick in proposal.chosen.clone() {
            // `t` as `t` is what it says.
            if pick.factor != 1.0 || pick.name != pick.channel || self.headers.iter().all(|header| *header != pick.name)
            {
                self.take(&pick);
                self.chosen.push(pick);
            }
        }
        proposal
    }

    /// What of the file a column is.
    pub fn pick(&self, place: usize, name: &str, is_step: bool) -> Pick {
        let header = &self.headers[place];
        let channel = match self.less[place] {
            Some(other) => format!("diff({header},{})", self.headers[other]),
            None if is_step => format!("sum({header})"),
            None => header.clone(),
        };
        let (factor, offset) = self.scaled[place];
        Pick { factor, offset, ..Pick::new(name, &channel, None) }
    }

    /// To SI: the name's own unit, or that of the row of units, after the map's factor and offset.
    pub fn conversion(&self, place: usize, channel: Channel, own: Conversion, head: &Head) -> Conversion {
        let plain = self.renamed[place] == self.headers[place] && own == Conversion::NONE;
        let beside = head.units[place].filter(|unit| plain && fits(*unit, channel));
        let own = beside.map_or(own, |unit| unit::converted(channel, unit).unwrap_or(own));
        let (factor, offset) = self.scaled[place];
        // An offset is in the unit that the name says.
        Conversion { scale: own.scale * factor, offset: own.offset + own.scale * offset, ..own }
    }
}

/// Seconds for one of a time of this name.
pub fn seconds(name: &str) -> Option<f64> {
    match unit::name(name) {
        Name::Known(Channel::Time, own) => Some(own.scale * 10_f64.powi(own.exponent - 9)),
        _ => None,
    }
}

fn fits(unit: Unit, channel: Channel) -> bool {
    matches!(
        (unit.quantity, channel),
        (Quantity::Time, Channel::Time)
            | (Quantity::Rate, Channel::Gyro(_) | Channel::RefRate(_))
            | (Quantity::Angle, Channel::RefAngle(_))
            | (Quantity::Acceleration, Channel::Accel(_))
            | (Quantity::Temperature, Channel::Temperature)
            | (Quantity::Voltage, Channel::Supply)
    )
}

/// How the time in this column is written, as the first rows show.
pub fn time_form(head: &Head, column: usize, conversion: Conversion) -> Form {
    let sample = |i: usize| head.samples.first().and_then(|row| row.get(i)).map_or(&b""[..], Vec::as_slice);
    let count = head.names.len();
    if let Some(form) = text::form(sample(column)) {
        let date =
            (0..count).find(|&i| i != column && text::date(sample(i)).is_some() && text::form(sample(i)).is_none());
        return match (form, date) {
            (Form::Clock, Some(date)) => Form::DateAndClock(date),
            _ => form,
        };
    }
    if text::date(sample(column)).is_some()
        && let Some(clock) = (0..count).find(|&i| text::form(sample(i)) == Some(Form::Clock))
    {
        return Form::DateAndClock(clock);
    }
    if conversion.exponent == 9 && head.is_clock_in_digits(column) {
        return Form::Digits;
    }
    if let Some((fine, exponent)) = head.finer(column) {
        return Form::Parts(fine, exponent);
    }
    // A time since 1970 tells its unit by its size; one in seconds of so many digits would lie 3000 years ahead.
    if conversion.exponent == 9
        && let text::TimeField::Nanoseconds(first) = text::time(sample(column), head.dialect.point, 0)
        && first as f64 > 1e11
        && let Some(unit) = meaning::epoch_unit(first as f64)
    {
        return Form::Number(unit::converted(Channel::Time, unit).map_or(9, |c| c.exponent));
    }
    Form::Number(conversion.exponent)
}
