//! Wall times of the stages.

use std::time::Instant;

/// Stages and their seconds, in the order of their first start.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    stages: Vec<(&'static str, f64)>,
}

impl Clock {
    /// Runs a closure and adds its time to that of a stage.
    pub fn time<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        let seconds = start.elapsed().as_secs_f64();
        match self.stages.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, sum)) => *sum += seconds,
            None => self.stages.push((stage, seconds)),
        }
        done
    }

    /// Returns all stages and their seconds.
    pub fn stages(self) -> Vec<(&'static str, f64)> {
        self.stages
    }
}
