//! The paper's figures 4–10.

use gyro_model::paper::{Found, Iteration, Point, Reproduction};
use workbench::plot::{Colour, Figure, Mark, Panel, Series};

/// The stretch of the run that is drawn, s: four periods.
const SHOWN: f64 = 16.0;

/// A figure with the paper's number and a caption.
type Numbered = (u32, Figure, String);

const RATE: &str = "angular velocity X, °/s";
const ANGLE: &str = "displacement X, °";

/// Every figure.
pub fn all(r: &Reproduction) -> Vec<Numbered> {
    let shown = Shown(r.points.iter().copied().take_while(|p| p.t <= SHOWN).collect());
    let mut figures = vec![raw(&shown), filtered_rate(&shown), filtered_angle(&shown)];
    figures.push((
        7,
        parameters(r),
        "From the stated start α = 1, δ = 0. The problem is linear in both, so one step does it.".into(),
    ));
    figures.push((8, error(r), ERROR_SAYS.into()));
    figures.push(compensated_rate(&shown));
    figures.push(compensated_angle(&shown));
    figures
}

/// The stretch that is drawn.
struct Shown(Vec<Point>);

impl Shown {
    fn line(&self, label: &str, colour: Colour, mark: Mark, value: fn(&Point) -> f64) -> Series {
        let points = self.0.iter().map(|p| (p.t, value(p).to_degrees())).collect();
        Series { label: label.into(), colour, mark, points }
    }

    fn encoder_rate(&self) -> Series {
        self.line("encoder", Colour::Black, Mark::Line, |p| p.encoder_rate)
    }

    fn encoder_angle(&self) -> Series {
        self.line("encoder", Colour::Black, Mark::Line, |p| p.encoder_angle)
    }

    /// The paper's observer, with either gain.
    fn observed(&self, value: [fn(&Point) -> f64; 2]) -> [Series; 2] {
        [
            self.line("paper's filter, Riccati gain", Colour::Blue, Mark::Line, value[0]),
            self.line("paper's filter, printed gain", Colour::Green, Mark::Line, value[1]),
        ]
    }
}

/// The encoder where another line lies upon it.
fn under(series: Series) -> Series {
    Series { colour: Colour::Grey, mark: Mark::Wide, ..series }
}

fn over_time(title: &str, panels: Vec<(&str, Vec<Series>)>) -> Figure {
    let panel = |(y, series): (&str, Vec<Series>)| Panel { y: y.into(), logarithmic: false, series };
    Figure { title: title.into(), x: "time, s".into(), panels: panels.into_iter().map(panel).collect() }
}

fn raw(shown: &Shown) -> Numbered {
    let reading = shown.line("raw gyro", Colour::Sky, Mark::Thin, |p| p.gyro);
    (
        4,
        over_time("Figure 4: encoder and raw gyro", vec![(RATE, vec![reading, shown.encoder_rate()])]),
        "The reading is less than half the rate (α > 1), shifted (δ) and noisy.".into(),
    )
}

fn filtered_rate(shown: &Shown) -> Numbered {
    let [riccati, printed] = shown.observed([|p| p.observed_rate[0], |p| p.observed_rate[1]]);
    let filtered = shown.line("Kalman filter", Colour::Vermilion, Mark::Line, |p| p.filtered_rate);
    let noise = shown.line("raw gyro − Kalman filter", Colour::Sky, Mark::Thin, |p| p.gyro - p.filtered_rate);
    let panels = vec![
        (RATE, vec![shown.encoder_rate(), filtered]),
        (RATE, vec![shown.encoder_rate(), riccati, printed]),
        ("taken out, °/s", vec![noise]),
    ];
    (
        5,
        over_time("Figure 5: encoder and Kalman-filtered gyro, velocity", panels),
        "Above, the sound filter: the noise is gone (at the bottom, what it took out), scale and bias remain, nothing \
         is late. In the middle, the paper's observer (9) as printed: it leaves out its input, so it turns and \
         amplifies the sine."
            .into(),
    )
}

fn filtered_angle(shown: &Shown) -> Numbered {
    let [riccati, printed] = shown.observed([|p| p.observed_angle[0], |p| p.observed_angle[1]]);
    let filtered = shown.line("Kalman filter", Colour::Vermilion, Mark::Line, |p| p.filtered_angle);
    let panels =
        vec![(ANGLE, vec![shown.encoder_angle(), filtered]), (ANGLE, vec![shown.encoder_angle(), riccati, printed])];
    (
        6,
        over_time("Figure 6: encoder and Kalman-filtered gyro, displacement", panels),
        "The integral of the reading: too small by α, running away by δ.".into(),
    )
}

fn compensated_rate(shown: &Shown) -> Numbered {
    let series = vec![
        under(shown.encoder_rate()),
        shown.line("compensated", Colour::Sky, Mark::Thin, |p| p.compensated_rate),
        shown.line("compensated and filtered", Colour::Vermilion, Mark::Line, |p| p.compensated_filtered_rate),
    ];
    (
        9,
        over_time("Figure 9: encoder and compensated gyro, velocity", vec![(RATE, series)]),
        "α and δ as found, open loop.".into(),
    )
}

fn compensated_angle(shown: &Shown) -> Numbered {
    let compensated = shown.line("compensated", Colour::Vermilion, Mark::Line, |p| p.compensated_angle);
    let left =
        shown.line("compensated − encoder", Colour::Vermilion, Mark::Thin, |p| p.compensated_angle - p.encoder_angle);
    let panels = vec![(ANGLE, vec![under(shown.encoder_angle()), compensated]), ("what remains, °", vec![left])];
    (
        10,
        over_time("Figure 10: encoder and compensated gyro, displacement", panels),
        "Below, what remains: the gyro's noise, integrated, and the encoder's counts. Here nothing else was simulated; \
         on a real gyro this is where missing physics shows (`truerate diagnose`)."
            .into(),
    )
}

const ERROR_SAYS: &str = "On the gyro's own angle the error falls to that of noise. On the paper's filtered angle it \
                          stays large: no α makes a sine out of one that is turned in phase.";

/// Figure 8.
fn error(r: &Reproduction) -> Figure {
    let panel = Panel { y: "RMS error, °".into(), logarithmic: true, series: ways(r, |i| i.rms.to_degrees()) };
    Figure {
        title: "Figure 8: root mean square error over the iterations".into(),
        x: "iteration".into(),
        panels: vec![panel],
    }
}

/// Figure 7.
fn parameters(r: &Reproduction) -> Figure {
    let panel =
        |y: &str, value: fn(&Iteration) -> f64| Panel { y: y.into(), logarithmic: false, series: ways(r, value) };
    Figure {
        title: "Figure 7: the parameters over the iterations".into(),
        x: "iteration".into(),
        panels: vec![panel("scale factor α", |i| i.alpha), panel("bias δ, °/s", |i| i.delta.to_degrees())],
    }
}

/// A value over the iterations, on the angle itself and on the paper's filtered ones.
fn ways(r: &Reproduction, value: fn(&Iteration) -> f64) -> Vec<Series> {
    let way = |label: &str, colour, found: &Found| Series {
        label: label.into(),
        colour,
        mark: Mark::Dotted,
        points: found.iterations.iter().enumerate().map(|(k, i)| (k as f64, value(i))).collect(),
    };
    vec![
        way("on the gyro's angle (sound)", Colour::Vermilion, &r.found),
        way("on the filtered angle, Riccati gain", Colour::Blue, &r.printed_way[0].found),
        way("on the filtered angle, printed gain", Colour::Green, &r.printed_way[1].found),
    ]
}
