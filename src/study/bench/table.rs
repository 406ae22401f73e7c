//! The report as text: one table of best modes, one of all of them.

use super::report::{Beams, Choices, Report, Row};
use crate::study::text::{figure, grid, grouped};
use crate::traverse::Kernel;
use std::fmt;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let h = &self.header;
        let triangles = grouped(h.triangles as u64);
        writeln!(f, "{}: {triangles} triangles, camera {}, {} x {}", h.model, h.camera, h.size, h.size)?;
        writeln!(
            f,
            "{}, {} hardware threads, {} build, seed {}",
            h.machine, h.hardware_threads, h.build, h.seed
        )?;
        let engines: Vec<String> =
            h.engines.iter().map(|e| format!("{} {} ({})", e.name, e.version, e.isa)).collect();
        writeln!(f, "{}, {}", engines.join(", "), h.date)?;
        if h.engines.iter().any(|e| e.name == "raypack") {
            let given = if h.slices { "; all kernels are given rays in a row" } else { "" };
            let pools = if h.pools { "; pools are kept beside the tree" } else { "" };
            writeln!(f, "raypack's accuracy: {}{given}{pools}", h.accuracy)?;
        }
        writeln!(f, "\nMillion rays a second, median of the rounds; the best mode of each engine\n")?;
        write!(f, "{}", grid(&self.summary()))?;
        writeln!(f, "\nEvery mode that ran\n")?;
        write!(f, "{}", grid(&self.modes()))?;
        if !self.choices.is_empty() {
            writeln!(f, "\nOf a hundred rays, those that went to each kernel where raypack chooses\n")?;
            write!(f, "{}", grid(&self.choice_lines()))?;
        }
        if !self.beams.is_empty() {
            writeln!(
                f,
                "\nWhat a beam of up to 256 rays does in raypack's tile kernel, on average (counted on portable)\n"
            )?;
            write!(f, "{}", grid(&self.beam_lines()))?;
        }
        if !self.agreements.is_empty() {
            writeln!(f, "\nDisagreements (hit against miss, or t apart by more than 1e-4)\n")?;
            write!(f, "{}", grid(&self.agreement_lines()))?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "\nnote: {note}"))
    }
}

impl Report {
    /// A line for each kind of ray and mode that chooses, with a column for each kernel that was chosen by any.
    fn choice_lines(&self) -> Vec<Vec<String>> {
        let of = |choices: &Choices, kernel: Kernel| {
            choices
                .kernels
                .iter()
                .filter(|share| share.kernel == kernel.name())
                .map(|share| share.rays)
                .sum::<u64>()
        };
        let is_taken = |&kernel: &Kernel| self.choices.iter().any(|choices| of(choices, kernel) > 0);
        let kernels: Vec<Kernel> = Kernel::ALL.into_iter().filter(is_taken).collect();
        let mut head = ["rays", "mode"].map(String::from).to_vec();
        head.extend(kernels.iter().map(|kernel| kernel.name().to_owned()));
        let line = |choices: &Choices| {
            let all: u64 = choices.kernels.iter().map(|share| share.rays).sum();
            let part = |&kernel: &Kernel| figure(100.0 * of(choices, kernel) as f64 / all as f64);
            let mut line = vec![choices.rays.name().to_owned(), choices.mode.clone()];
            line.extend(kernels.iter().map(part));
            line
        };
        std::iter::once(head).chain(self.choices.iter().map(line)).collect()
    }

    /// A line for each kind of ray that made beams.
    fn beam_lines(&self) -> Vec<Vec<String>> {
        let head = [
            "rays",
            "tiles",
            "beams",
            "nodes",
            "packets in a node",
            "pages",
            "blocks",
            "triangles",
            "left for the beam",
            "packet tests",
            "packets alone",
        ];
        let line = |beams: &Beams| {
            let c = &beams.counts;
            let each = |count: u64| figure(count as f64 / c.beams.max(1) as f64);
            vec![
                beams.rays.name().into(),
                grouped(beams.tiles as u64),
                grouped(c.beams),
                each(c.nodes),
                figure(c.node_packets as f64 / c.nodes.max(1) as f64),
                each(c.pages),
                each(c.blocks),
                each(c.triangles),
                each(c.left),
                each(c.tests),
                each(c.alone),
            ]
        };
        [head.map(String::from).into()].into_iter().chain(self.beams.iter().map(line)).collect()
    }

    /// A line for each race: every engine's best mode, and raypack's ratio to each rival.
    fn summary(&self) -> Vec<Vec<String>> {
        let names: Vec<&str> = self.header.engines.iter().map(|e| e.name).collect();
        let rivals: Vec<&str> = names.iter().copied().filter(|&n| n != "raypack").collect();
        let compares = names.contains(&"raypack");
        let mut head: Vec<String> = ["rays", "threads"].map(String::from).into();
        for name in &names {
            head.extend([(*name).to_owned(), String::new()]);
        }
        if compares {
            head.extend(rivals.iter().map(|rival| format!("raypack : {rival}")));
        }
        let mut lines = vec![head];
        for (kind, threads) in self.races() {
            let mut line = vec![kind.name().into(), threads.to_string()];
            for name in &names {
                let best = self.best(name, kind, threads);
                line.push(best.map_or_else(|| "-".into(), |row| figure(row.mrays_per_s)));
                line.push(best.map_or_else(String::new, |row| row.mode.clone()));
            }
            if let Some(ours) = self.best("raypack", kind, threads).filter(|_| compares) {
                for rival in &rivals {
                    let ratio = self.best(rival, kind, threads).map(|row| ours.mrays_per_s / row.mrays_per_s);
                    line.push(ratio.map_or_else(|| "-".into(), verdict));
                }
            }
            lines.push(line);
        }
        lines
    }

    fn modes(&self) -> Vec<Vec<String>> {
        let head =
            ["rays", "threads", "engine", "mode", "Mrays/s", "low", "high", "hits", "of", "build s", "MiB"];
        let mut lines = vec![head.map(String::from).to_vec()];
        for (kind, threads) in self.races() {
            let of_race = self.rows.iter().filter(|r| r.rays == kind && r.threads == threads);
            lines.extend(of_race.map(|r: &Row| {
                vec![
                    kind.name().into(),
                    threads.to_string(),
                    r.engine.into(),
                    r.mode.clone(),
                    figure(r.mrays_per_s),
                    figure(r.low),
                    figure(r.high),
                    r.hits.to_string(),
                    r.count.to_string(),
                    format!("{:.2}", r.build_seconds),
                    format!("{:.1}", r.bytes as f64 / (1 << 20) as f64),
                ]
            }));
        }
        lines
    }

    fn agreement_lines(&self) -> Vec<Vec<String>> {
        let head = ["rays", "one", "other", "disagree", "of", "per million"];
        let line = |a: &super::Agreement| {
            let (count, per_million) = (a.count.to_string(), format!("{:.1}", a.per_million));
            let name = a.rays.name().into();
            vec![name, a.first.clone(), a.second.clone(), a.disagreements.to_string(), count, per_million]
        };
        std::iter::once(head.map(String::from).to_vec()).chain(self.agreements.iter().map(line)).collect()
    }
}

/// A ratio and what it means for us.
fn verdict(ratio: f64) -> String {
    format!("{ratio:.2} {}", if ratio >= 1.0 { "won" } else { "lost" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_is_called_one() {
        assert_eq!(verdict(0.5), "0.50 lost");
        assert_eq!(verdict(1.25), "1.25 won");
    }
}
