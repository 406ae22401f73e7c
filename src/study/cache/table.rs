//! What flights through caches took, as text.

use super::{Report, Shape};
use crate::cache::Prefetch;
use crate::cache::policy::Replacement;
use crate::study::text::{figure, grid, grouped};
use std::fmt;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} triangles, {:.1} MB of data in blocks (file {:.1} MB)",
            self.scene,
            grouped(self.triangles),
            self.data_bytes as f64 * 1e-6,
            self.file_bytes as f64 * 1e-6
        )?;
        writeln!(
            f,
            "{} frames of {}, {} degrees apart, {}{}; {} threads, {}, {}, {}, raypack {} ({} build), {}",
            self.frames,
            self.size,
            self.step_degrees,
            if self.shadows { "camera and shadow rays" } else { "camera rays" },
            match self.warm_flights {
                1 => String::new(),
                flights => format!(", warm after {flights} flights"),
            },
            self.threads,
            self.isa,
            self.accuracy,
            self.processor,
            self.raypack,
            self.build,
            self.date
        )?;
        let how = if self.direct {
            "past the system's memory: what a read takes is what the disk takes"
        } else {
            "through the system's memory: the file may be there already, and a read then takes microseconds"
        };
        writeln!(f, "reads go {how}\n")?;
        let resident = self.rows.first().map_or(1.0, |row| row.rays_per_s);
        let shapes: Vec<Shape> = self.rows.iter().filter_map(|row| row.shape).collect();
        let differences = Shape::differences(&shapes);
        let head = [
            "in memory",
            "policy",
            "loading",
            "pass",
            "Mrays/s",
            "of resident",
            "x paper",
            "hits %",
            "blocks read",
            "least",
            "MB read",
            "ahead",
            "used %",
            "stalled s",
            "loaders idle %",
            "tile ms p50",
            "p99",
            "frame ms p50",
            "p99",
            "all",
        ];
        // What tells caches from one another stands behind their policy.
        let with =
            |line: &[String], differences: Vec<String>| [&line[..2], &differences, &line[2..]].concat();
        let names = differences.iter().map(|(name, _)| name.to_string()).collect();
        let mut lines = vec![with(&head.map(String::from), names)];
        for row in &self.rows {
            let of = |cached: String| if row.policy.is_some() { cached } else { "-".into() };
            let line = [
                format!("{:.0} %", row.budget * 100.0),
                row.policy.map_or("resident", Replacement::name).into(),
                row.loading.map_or("-", |loading| loading.name(row.prefetch())).into(),
                if row.warm { "warm" } else { "cold" }.into(),
                figure(row.rays_per_s * 1e-6),
                format!("{:.2}", row.rays_per_s / resident),
                format!("{:.0}", row.rays_per_s / self.paper.rays_per_s[1]),
                of(format!("{:.2}", row.hit_ratio * 100.0)),
                of(row.loads.to_string()),
                of(row.minimum.to_string()),
                of(format!("{:.1}", row.bytes_read as f64 * 1e-6)),
                if row.prefetch() != Prefetch::Off { row.prefetched.to_string() } else { "-".into() },
                match row.prefetched_used + row.prefetched_unused {
                    0 => "-".into(),
                    known => format!("{:.0}", 100.0 * row.prefetched_used as f64 / known as f64),
                },
                of(format!("{:.2}", row.stalled)),
                of(format!("{:.0}", row.loader_idle * 100.0)),
                format!("{:.2}", row.tile_p50 * 1e3),
                format!("{:.2}", row.tile_p99 * 1e3),
                format!("{:.1}", row.frame_p50 * 1e3),
                format!("{:.1}", row.frame_p99 * 1e3),
                format!("{:.1}-{:.1}", row.frame_seconds[1] * 1e3, row.frame_seconds[0] * 1e3),
            ];
            let value = |of: fn(&Shape) -> String| row.shape.map_or("-".into(), |shape| of(&shape));
            lines.push(with(&line, differences.iter().map(|(_, of)| value(*of)).collect()));
        }
        f.write_str(&grid(&lines))?;
        writeln!(
            f,
            "\nleast: what the policy that knows the future would have read (Belady's MIN, on the uses of that \
             flight)\nahead: blocks that came before they were needed; used: of those whose fate is known, how \
             many were needed then\nx paper: of the {:.0} thousand rays/s that the paper's fastest cache reached\np50, p99: half and 99 % of \
             the tiles or frames of a flight took no longer",
            self.paper.rays_per_s[1] * 1e-3
        )?;
        self.tables.iter().try_for_each(|table| write!(f, "\n{table}"))?;
        let [least, most] = self.paper.rays_per_s.map(|rate| grouped(rate as u64));
        write!(
            f,
            "\nknown of the paper: all of its caches and frames lie between {least} and {most} rays/s; what each \
             frame took is not known here{}\nx {most}: of its fastest, our slowest and our fastest policy in that \
             frame\n\n{}",
            if self.beside.is_some() { "" } else { " (--beside has a file of it stand beside ours)" },
            self.paper
        )
    }
}
