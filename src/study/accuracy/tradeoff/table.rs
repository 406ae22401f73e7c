//! The report as text.

use super::report::{Choice, FrameRow, RayRow, Report, Within};
use crate::render::Limits;
use crate::study::text::{figure, grid, grouped};
use std::fmt;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let h = &self.header;
        let threads = if h.threads == 1 { "1 thread".into() } else { format!("{} threads", h.threads) };
        writeln!(
            f,
            "{}: {} triangles, camera {}, {}",
            h.model,
            grouped(h.triangles as u64),
            h.camera,
            h.size
        )?;
        writeln!(
            f,
            "{}, {threads} of {}, {} build, seed {}",
            h.machine, h.hardware_threads, h.build, h.seed
        )?;
        let engines: Vec<String> =
            h.engines.iter().map(|e| format!("{} {} ({})", e.name, e.version, e.isa)).collect();
        writeln!(f, "{}, {}", engines.join(", "), h.date)?;
        writeln!(f, "\nRays: nanoseconds a ray (wall clock, {threads}), and errors per million rays\n")?;
        write!(f, "{}", grid(&self.ray_lines()))?;
        writeln!(f, "\n* raypack's default. ^ on the Pareto front: no other mode here is quicker and less")?;
        writeln!(
            f,
            "often wrong. \"wrong\" is another triangle than the nearest, \"elsewhere\" the part of it"
        )?;
        writeln!(f, "whose t is off by more than 1e-4. Ulps of t are those of right hits: 99.9 %, and all.")?;
        let r = &self.reference;
        writeln!(
            f,
            "\nFrames: {}, shading and shadows included, {}, tiles of {t}x{t}; errors against the\n\
             reference ({}, {} samples per pixel, rendered in {:.1} s)\n",
            h.size,
            h.tuning.packet.rays(),
            r.accuracy,
            r.samples,
            r.seconds,
            t = h.tuning.tile,
        )?;
        write!(f, "{}", grid(&self.frame_lines()))?;
        writeln!(
            f,
            "\nRMSE and PSNR of linear light cut to 0 to 1; SSIMULACRA2 of the 8-bit picture: 100 is"
        )?;
        writeln!(f, "equal, 90 hard to tell apart.")?;
        if let Some(within) = &self.within {
            write!(f, "\n{within}")?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "\nnote: {note}"))
    }
}

impl Report {
    fn ray_lines(&self) -> Vec<Vec<String>> {
        let head = [
            "rays",
            "engine",
            "mode",
            "",
            "kernel",
            "ns/ray",
            "low",
            "high",
            "Mrays/s",
            "errors/M",
            "missed",
            "false",
            "wrong",
            "elsewhere",
            "of",
            "ulps",
            "max",
        ];
        let line = |row: &RayRow| {
            let e = &row.errors;
            let million = |count: u64| rate(e.per_million(count));
            let ulps = e.deviation.as_ref();
            vec![
                row.rays.name().into(),
                row.engine.into(),
                row.mode.into(),
                marks(row.default, row.pareto),
                row.kernel.clone(),
                figure(row.ns_per_ray),
                figure(row.ns_low),
                figure(row.ns_high),
                figure(row.mrays_per_s),
                rate(row.per_million.total),
                million(e.missed),
                million(e.false_hits),
                million(e.wrong_primitive),
                million(e.elsewhere),
                e.count.to_string(),
                ulps.map_or_else(|| "-".into(), |d| d.p999_ulps.to_string()),
                ulps.map_or_else(|| "-".into(), |d| d.max_ulps.to_string()),
            ]
        };
        std::iter::once(head.map(String::from).to_vec()).chain(self.rays.iter().map(line)).collect()
    }

    fn frame_lines(&self) -> Vec<Vec<String>> {
        let head = [
            "samples",
            "mode",
            "",
            "ms/frame",
            "low",
            "high",
            "frames",
            "Mrays",
            "RMSE",
            "PSNR dB",
            "SSIMULACRA2",
        ];
        let line = |row: &FrameRow| {
            vec![
                match row.limits {
                    Some(limits) => format!("{}; {limits}", row.samples),
                    None => row.samples.to_string(),
                },
                row.accuracy.to_string(),
                marks(row.default, row.pareto),
                figure(row.ms),
                figure(row.ms_low),
                figure(row.ms_high),
                row.rounds.to_string(),
                format!("{:.2}", row.rays as f64 * 1e-6),
                format!("{:.6}", row.error.rmse),
                row.error.psnr.map_or_else(|| "equal".into(), |psnr| format!("{psnr:.2}")),
                format!("{:.2}", row.error.ssimulacra2),
            ]
        };
        std::iter::once(head.map(String::from).to_vec()).chain(self.frames.iter().map(line)).collect()
    }
}

impl fmt::Display for Within {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let budget = figure(self.budget_ms);
        if !self.fits {
            writeln!(f, "within {budget} ms: nothing fits; the quickest is {}", self.picked)?;
            return writeln!(f, "try fewer pixels (--size), fewer samples (--samples) or more threads");
        }
        writeln!(f, "within {budget} ms: {}", self.picked)?;
        match &self.next {
            Some(next) => {
                writeln!(f, "gave up: {next}")?;
                let (picked, next) = (&self.picked.error, &next.error);
                writeln!(
                    f,
                    "         {:+.6} of RMSE and {:+.2} of SSIMULACRA2",
                    picked.rmse - next.rmse,
                    picked.ssimulacra2 - next.ssimulacra2
                )
            }
            None => writeln!(f, "gave up: nothing; no setting that was measured is more accurate"),
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.samples == 1 { "" } else { "s" };
        write!(
            f,
            "--accuracy {} --samples {}{}: {} sample{plural} per pixel, {} ms a frame (median of {}, {} to {}), RMSE {:.6}, SSIMULACRA2 {:.2}",
            self.accuracy,
            self.samples,
            self.limits.map_or_else(String::new, |limits| {
                let Limits { bounces, shadow_samples, roulette, .. } = limits;
                format!(" --bounces {bounces} --shadow-samples {shadow_samples} --roulette {roulette}")
            }),
            self.samples,
            figure(self.ms),
            self.frames,
            figure(self.ms_low),
            figure(self.ms_high),
            self.error.rmse,
            self.error.ssimulacra2
        )
    }
}

fn marks(default: bool, pareto: bool) -> String {
    [(default, '*'), (pareto, '^')].into_iter().filter(|mark| mark.0).map(|mark| mark.1).collect()
}

/// Errors per million: none is plainly none.
fn rate(per_million: f64) -> String {
    if per_million == 0.0 { "0".into() } else { figure(per_million) }
}
