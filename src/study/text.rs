//! Figures and tables as text.

use std::fmt::Write;

/// Three digits that matter.
pub fn figure(mrays: f64) -> String {
    match mrays {
        m if m >= 100.0 => format!("{m:.0}"),
        m if m >= 10.0 => format!("{m:.1}"),
        m => format!("{m:.2}"),
    }
}

/// A number with its thousands set apart: `1,234,567`.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Columns as wide as their widest cell; numbers to the right.
pub fn grid(lines: &[Vec<String>]) -> String {
    let columns = lines.first().map_or(0, Vec::len);
    let width = |c: usize| lines.iter().filter_map(|l| l.get(c)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|c| width(c).unwrap_or(0)).collect();
    let mut text = String::new();
    for (i, line) in lines.iter().enumerate() {
        let mut row = String::new();
        for (c, (cell, &width)) in line.iter().zip(&widths).enumerate() {
            // A heading stands as its column's cells do.
            let sample = if i == 0 { lines.get(1).and_then(|l| l.get(c)).unwrap_or(cell) } else { cell };
            let number = sample == "-" || sample.replace(',', "").parse::<f64>().is_ok();
            let gap = if c == 0 { "" } else { "  " };
            let written =
                if number { write!(row, "{gap}{cell:>width$}") } else { write!(row, "{gap}{cell:<width$}") };
            written.expect("writing to a string cannot fail");
        }
        text += row.trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_align() {
        let lines = [["a", "n", "x"], ["long", "12.5", "y"], ["b", "3", ""]];
        let lines: Vec<Vec<String>> = lines.iter().map(|l| l.map(String::from).to_vec()).collect();
        assert_eq!(grid(&lines), "a        n  x\nlong  12.5  y\nb        3\n");
        let lines = [["n"], ["1,234"], ["5"]].map(|line| line.map(String::from).to_vec());
        assert_eq!(grid(&lines), "    n\n1,234\n    5\n");
    }

    #[test]
    fn figures_read_well() {
        assert_eq!([figure(123.4), figure(12.34), figure(1.234)], ["123", "12.3", "1.23"]);
        assert_eq!(
            [0, 12, 123, 1234, 123_456, 1_234_567].map(grouped),
            ["0", "12", "123", "1,234", "123,456", "1,234,567"]
        );
    }
}
