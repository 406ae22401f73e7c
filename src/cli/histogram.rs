//! Histograms in text.

use super::report::{Lines, grouped};

/// Columns of the longest bar.
const WIDTH: usize = 40;

/// Most rows: larger histograms are drawn with several entries to a row.
const ROWS: usize = 16;

/// Draws a histogram of what `noun` says, a bar a row. `label` gives the name of an entry; rows of several
/// entries have the names of the first and the last. What is beyond the last entry that counts something,
/// and before the first, is left out.
pub fn bars(lines: &mut Lines, title: &str, noun: &str, counts: &[usize], label: impl Fn(usize) -> String) {
    let Some(first) = counts.iter().position(|&count| count > 0) else { return };
    let last = counts.iter().rposition(|&count| count > 0).unwrap_or(first);
    let per_row = (last - first + 1).div_ceil(ROWS);
    let rows: Vec<(String, usize)> = (first..=last)
        .step_by(per_row)
        .map(|from| {
            let to = (from + per_row - 1).min(last);
            let name = if from == to { label(from) } else { format!("{}-{}", label(from), label(to)) };
            (name, counts[from..=to].iter().sum())
        })
        .collect();
    let most = rows.iter().map(|(_, count)| *count).max().unwrap_or(1).max(1);
    let total: usize = counts.iter().sum::<usize>().max(1);
    lines.add(title, noun);
    for (name, count) in rows {
        // What is there at all has a mark.
        let length = if count == 0 { 0 } else { (count * WIDTH).div_ceil(most) };
        let share = 100.0 * count as f64 / total as f64;
        let bar =
            format!("{name:>9} {:<WIDTH$} {} ({share:.1} %)", "#".repeat(length), grouped(count as u64));
        lines.add("", bar);
    }
}

/// The numbers below a power of ten: `<10`, `<0.01`.
pub fn decades(power: i32) -> String {
    match power {
        0 => "<=1".into(),
        1..=4 => format!("<{}", 10u32.pow(power as u32)),
        -4..=-1 => format!("<{:.*}", power.unsigned_abs() as usize, 10f64.powi(power)),
        _ => format!("<1e{power}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_what_they_count() {
        let mut lines = Lines::default();
        bars(&mut lines, "sizes", "leaves", &[0, 10, 1, 0, 5, 0], |i| i.to_string());
        let text = lines.text();
        let rows: Vec<usize> = text.lines().skip(1).map(|row| row.matches('#').count()).collect();
        assert_eq!(rows, [40, 4, 0, 20], "{text}");
        assert!(text.contains("10 (62.5 %)"), "{text}");
    }

    #[test]
    fn long_histograms_share_rows_and_lose_nothing() {
        let mut lines = Lines::default();
        bars(&mut lines, "sizes", "leaves", &[1; 33], |i| i.to_string());
        let text = lines.text();
        assert_eq!(text.lines().count(), 1 + 11, "{text}");
        assert!(text.contains("0-2") && text.contains("30-32"), "{text}");
    }

    #[test]
    fn decades_read_well() {
        for (power, text) in [(0, "<=1"), (2, "<100"), (-2, "<0.01"), (7, "<1e7"), (-7, "<1e-7")] {
            assert_eq!(decades(power), text);
        }
    }
}
