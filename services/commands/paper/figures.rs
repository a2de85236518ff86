//! The paper's figures 4–10.

use crate::plot::{Colour, Figure, Mark, Panel, Series};
use gyro_model::paper::{Found, Iteration, Point, Reproduction};

/// The stretch of the run that is drawn, s: four periods.
const SHOWN: f64 = 16.0;

/// Every figure with the paper's number and a caption.
pub fn all(r: &Reproduction) -> Vec<(u32, Figure, String)> {
    let shown: Vec<Point> = r.points.iter().copied().take_while(|p| p.t <= SHOWN).collect();
    let over_time = |label: &str, colour, mark, value: fn(&Point) -> f64| Series {
        label: label.into(),
        colour,
        mark,
        points: shown.iter().map(|p| (p.t, value(p).to_degrees())).collect(),
    };
    let encoder_rate = || over_time("encoder", Colour::Black, Mark::Line, |p| p.encoder_rate);
    let encoder_angle = || over_time("encoder", Colour::Black, Mark::Line, |p| p.encoder_angle);
    let under = |series: Series| Series { colour: Colour::Grey, mark: Mark::Wide, ..series };
    let time = |title: &str, panels: Vec<(&str, Vec<Series>)>| Figure {
        title: title.into(),
        x: "time, s".into(),
        panels: panels.into_iter().map(|(y, series)| Panel { y: y.into(), logarithmic: false, series }).collect(),
    };
    let rate = "angular velocity X, °/s";
    let angle = "displacement X, °";
    let left = |label: &str, value: fn(&Point) -> f64| Series {
        label: label.into(),
        colour: Colour::Vermilion,
        mark: Mark::Thin,
        points: r.points.iter().step_by(4).map(|p| (p.t, value(p).to_degrees())).filter(|p| p.0 <= SHOWN).collect(),
    };
    vec![
        (
            4,
            time(
                "Figure 4: encoder and raw gyro",
                vec![(rate, vec![over_time("raw gyro", Colour::Sky, Mark::Thin, |p| p.gyro), encoder_rate()])],
            ),
            "The reading is less than half the rate (α > 1), shifted (δ) and noisy.".into(),
        ),
        (
            5,
            time(
                "Figure 5: encoder and Kalman-filtered gyro, velocity",
                vec![
                    (
                        rate,
                        vec![
                            encoder_rate(),
                            over_time("Kalman filter", Colour::Vermilion, Mark::Line, |p| p.filtered_rate),
                        ],
                    ),
                    (
                        rate,
                        vec![
                            encoder_rate(),
                            over_time("paper's filter, Riccati gain", Colour::Blue, Mark::Line, |p| p.observed_rate[0]),
                            over_time("paper's filter, printed gain", Colour::Green, Mark::Line, |p| {
                                p.observed_rate[1]
                            }),
                        ],
                    ),
                ],
            ),
            "Above, the sound filter: the noise is gone (at the bottom, what it took out), scale and bias remain, nothing is late. In the middle, the paper's \
             observer (9) as it stands: it leaves out its input, so it turns and amplifies the sine."
                .into(),
        ),
        (
            6,
            time(
                "Figure 6: encoder and Kalman-filtered gyro, displacement",
                vec![
                    (
                        angle,
                        vec![
                            encoder_angle(),
                            over_time("Kalman filter", Colour::Vermilion, Mark::Line, |p| p.filtered_angle),
                        ],
                    ),
                    (
                        angle,
                        vec![
                            encoder_angle(),
                            over_time("paper's filter, Riccati gain", Colour::Blue, Mark::Line, |p| {
                                p.observed_angle[0]
                            }),
                            over_time("paper's filter, printed gain", Colour::Green, Mark::Line, |p| {
                                p.observed_angle[1]
                            }),
                        ],
                    ),
                ],
            ),
            "The integral of the reading: too small by α, running away by δ.".into(),
        ),
        (
            7,
            parameters(r),
            "From the stated start α = 1, δ = 0. The problem is linear in both, so one step does it.".into(),
        ),
        (
            8,
            Figure {
                title: "Figure 8: root mean square error over the iterations".into(),
                x: "iteration".into(),
                panels: vec![Panel {
                    y: "RMS error, °".into(),
                    logarithmic: true,
                    series: ways(r, |i| i.rms.to_degrees()),
                }],
            },
            "On the gyro's own angle the error falls to that of noise. On the paper's filtered angle it stays large: \
             no α makes a sine out of one that is turned in phase."
                .into(),
        ),
        (
            9,
            time(
                "Figure 9: encoder and compensated gyro, velocity",
                vec![(
                    rate,
                    vec![
                        under(encoder_rate()),
                        over_time("compensated", Colour::Sky, Mark::Thin, |p| p.compensated_rate),
                        over_time("compensated and filtered", Colour::Vermilion, Mark::Line, |p| {
                            p.compensated_filtered_rate
                        }),
                    ],
                )],
            ),
            "α and δ as found, open loop.".into(),
        ),
        (
            10,
            time(
                "Figure 10: encoder and compensated gyro, displacement",
                vec![
                    (
                        angle,
                        vec![
                            under(encoder_angle()),
                            over_time("compensated", Colour::Vermilion, Mark::Line, |p| p.compensated_angle),
                        ],
                    ),
                    ("what remains, °", vec![left("compensated − encoder", |p| p.compensated_angle - p.encoder_angle)]),
                ],
            ),
            "Below, what remains: the gyro's noise, integrated, and the encoder's counts. Here nothing else was \
             simulated; on a real gyro this is where missing physics shows (`truerate diagnose`)."
                .into(),
        ),
    ]
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
