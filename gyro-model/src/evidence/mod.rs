//! Evidence: what a log says about a model.
//!
//! | module | noun |
//! | --- | --- |
//! | `series` | one axis of a log, laid out for evaluation |
//! | [`encoder`], `encoder_noise` | the steps of a shaft encoder, and what they make it err by; the noise of the angle that it counts |
//! | [`problem`] | the residual of a model and its derivatives |
//! | `track` | one axis of it, step by step |
//! | `warm` | what its regressors are evaluated at |
//! | `shaft` | where the shaft was |
//! | `increments` | increments over averaging times: the error curve's Gram matrices, held out block by block |
//! | `attitude` | an orientation as reference |
//! | `knots` | a reference that is known seldom, straight lines between |
//! | `integrate` | integrals and smoothing of sampled rates |
//! | `heating`, `coarse` | how fast the temperature rises; its course between the steps of a coarse reading |
//! | `temperature_steps` | what those steps may make of a likelihood |
//! | [`study`] | a model fitted to a log |
//! | `gauss_newton` | the steps of that fit |
//! | `refine` | the same under the noise of its residual, and how well each parameter is known |
//! | `spectrum` | the fast Fourier transform of a series |
//! | `line` | one line of a signal's spectrum |
//! | `incoherent` | what of a reference the gyro knows nothing of, whatever its errors |
//! | `rough`, `gain` | a signal's noise and vibrations; how far a reference turns beside the readings |
//! | `prior` | the noise that the sensors' own signals show |
//! | `noise` | the noise of a model's residual, and generalised least squares under it |
//! | `identify` | how it is found: from nothing, or from one that is near |
//! | `instants` | how well the instant is known at which an effect begins |
//! | `whittle` | where to look for it: the periodogram |
//! | [`whiten`] | the noise as a state-space model: likelihood, generalised least squares |
//! | `likelihood` | the likeliest noise |
//! | `growth` | the part of it that grows with the rate |
//! | `rounding` | what a coarse reading's rounding leaves of rates that are held |
//! | `draws` | draws of noise alone on the log's own motion |
//! | `floor` | what the error curve would be with no physics missing |

pub(crate) mod attitude;
mod coarse;
mod dilution;
pub(crate) mod draws;
pub mod encoder;
mod encoder_noise;
pub(crate) mod floor;
mod forms;
pub(crate) mod gain;
mod gauss_newton;
mod growth;
mod heating;
pub(crate) mod identify;
pub(crate) mod incoherent;
pub(crate) mod increments;
mod instants;
pub(crate) mod integrate;
mod knots;
pub(crate) mod likelihood;
pub(crate) mod line;
pub(crate) mod noise;
pub(crate) mod prior;
pub mod problem;
mod refine;
pub(crate) mod rough;
pub(crate) mod rounding;
pub(crate) mod series;
mod shaft;
pub(crate) mod spectrum;
pub mod study;
mod temperature_steps;
pub(crate) mod track;
pub(crate) mod warm;
pub mod whiten;
pub(crate) mod whittle;
