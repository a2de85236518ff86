//! Plain lines, where standard output is no terminal: what changes, and how it stands every five seconds.

use super::{Ending, Show, screen};
use anyhow::Result;
use gyro_model::guide::State;
use workbench::{output::print, report::Terminal};

/// What was said last.
#[derive(Default)]
pub(super) struct Lines {
    said: String,
    corrected: Option<String>,
    known: Vec<(String, bool)>,
    troubles: Vec<String>,
    told: f64,
}

/// Between two lines that say how it stands, s.
const TELLS: f64 = 5.0;

impl Show for Lines {
    fn waits(&mut self, says: &str) -> Result<()> {
        let says = format!("waits {says}");
        if std::mem::replace(&mut self.said, says.clone()) != says {
            print(&says)?;
        }
        Ok(())
    }

    fn state(&mut self, state: &State, source: Option<&str>) -> Result<()> {
        let at = format!("{:>6.1} s", state.seconds);
        let says = state.says();
        if self.said != says {
            print(&format!("{at}  NOW: {says}"))?;
            (self.said, self.corrected) = (says, None);
        }
        let correction = state.correction();
        // Its number changes all the time; what is wrong does not.
        let kind = |text: &Option<String>| text.as_ref().and_then(|text| text.split(':').next().map(str::to_owned));
        if kind(&correction) != kind(&self.corrected)
            && let Some(correction) = &correction
        {
            print(&format!("{at}       {correction}"))?;
        }
        self.corrected = correction;
        let troubles: Vec<String> =
            state.troubles.iter().map(ToString::to_string).chain(source.map(str::to_owned)).collect();
        for trouble in troubles.iter().filter(|trouble| !self.troubles.contains(trouble)) {
            print(&format!("{at}  trouble: {trouble}"))?;
        }
        self.troubles = troubles;
        for goal in &state.goals {
            let name = format!("axis {} {} {}", goal.axis, goal.effect, goal.name);
            let is_over = goal.known || goal.out_of_reach.is_some();
            if is_over && !self.known.contains(&(name.clone(), goal.known)) {
                print(&format!("{at}  {}", screen::told(goal)))?;
                self.known.push((name, goal.known));
            }
        }
        if state.seconds >= self.told + TELLS {
            self.told = state.seconds;
            if let Some(now) = state.temperature.and_then(|course| screen::temperature(&course)) {
                print(&format!("{at}  {}", now.trim_start()))?;
            }
            let lacking = state.goals.iter().filter(|goal| goal.lacks());
            let each: Vec<String> = lacking.map(screen::stands).collect();
            if !each.is_empty() {
                print(&format!("{at}  {}", each.join("; ")))?;
            }
        }
        Ok(())
    }

    fn end(&mut self, ending: &Ending) -> Result<()> {
        print(&screen::end(ending, Terminal::detect().width).join("\n"))
    }
}
