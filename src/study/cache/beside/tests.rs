use super::*;
use crate::cache::CacheOptions;

const SHAPE: Shape = Shape { block: 4096, ways: 32, stripes: 16, nodes: None };
const SYNC: Loading = Loading::Synchronous;
const ASYNC: Loading = Loading::Asynchronous { loaders: 3 };

/// Reads such a file.
fn read(name: &str, text: &str) -> Result<Rates> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, text).expect("written");
    Rates::read(&path)
}

/// A cold table of FIFO and LRU with 16 % in memory, of two frames.
fn ours(loading: Loading, prefetch: Prefetch) -> FrameTable {
    FrameTable {
        budget: 0.16,
        loading,
        prefetch,
        warm: false,
        shape: SHAPE,
        differences: String::new(),
        policies: vec![Replacement::Fifo, Replacement::Lru],
        rays_per_s: vec![vec![1000.0, 2000.0], vec![3000.0, 4000.0]],
        paper_table: None,
        times_paper: Vec::new(),
        beside: None,
    }
}

#[test]
fn a_typed_table_stands_beside_ours() {
    let text = "[[table]]\nbudget = 16\nloading = \"sync\"\nlru = [500, 1000.5, 7]\nsieve = [1]\n\
                [[table]]\nbudget = 16\nloading = \"async\"\npass = \"cold\"\nfifo = [100]\n";
    let rates = read("paper.toml", text).expect("tables");
    let beside = rates.beside(&ours(SYNC, Prefetch::Off)).expect("one is of it");
    assert_eq!((beside.table, beside.policies.len()), (1, 1));
    let column = &beside.policies[0];
    assert_eq!((column.policy, &column.ours[..]), (Replacement::Lru, &[2000.0, 4000.0][..]));
    assert_eq!(column.beside, [Some(500.0), Some(1000.5)]);
    assert_eq!(column.ratio, [Some(4.0), Some(4000.0 / 1000.5)]);
    let text = beside.to_string();
    assert!(text.contains("lru ours  beside  ratio\n") && text.contains("4.00\n"), "{text}");

    // What is typed does not say what came before it was needed: it stands beside all of that.
    for prefetch in Prefetch::ALL {
        let beside = rates.beside(&ours(ASYNC, prefetch)).expect("one is of it");
        assert_eq!(beside.table, 2);
        assert_eq!(beside.policies[0].beside, [Some(100.0), None], "it has one frame");
        assert!(beside.to_string().lines().last().expect("a line").ends_with('-'), "{beside}");
    }
    let other = FrameTable { warm: true, ..ours(SYNC, Prefetch::Off) };
    assert!(rates.beside(&other).is_none(), "it has nothing warm");
    let other = FrameTable { budget: 0.39, ..ours(SYNC, Prefetch::Off) };
    assert!(rates.beside(&other).is_none());
}

#[test]
fn an_earlier_report_stands_beside_ours() {
    let mut tables = [ours(ASYNC, Prefetch::Off), ours(ASYNC, Prefetch::Beside), ours(SYNC, Prefetch::Off)];
    tables[2].shape.ways = 8;
    tables[2].rays_per_s[1][1] = 8000.0;
    let with = |tables: &[FrameTable]| {
        let report = serde_json::json!({ "scene": "a.rpk", "tables": tables });
        read("earlier.JSON", &report.to_string()).expect("a report")
    };
    let rates = with(&tables);
    assert_eq!(rates.beside(&ours(ASYNC, Prefetch::Beside)).expect("the same").table, 2);
    assert!(rates.beside(&ours(ASYNC, Prefetch::Ahead)).is_none());
    // Other caches do where there are none that were alike.
    let beside = rates.beside(&ours(SYNC, Prefetch::Off)).expect("of other ways");
    assert_eq!((beside.table, beside.policies[1].ratio[1]), (3, Some(0.5)));
    let both = [tables[2].clone(), ours(SYNC, Prefetch::Off)];
    assert_eq!(with(&both).beside(&ours(SYNC, Prefetch::Off)).expect("alike").table, 2);
}

#[test]
fn faults_are_named_with_the_file() {
    let table = "[[table]]\nbudget = 16\nloading = \"sync\"\n";
    for (name, text, expected) in [
        ("a.csv", String::new(), "unknown kind of file (.csv); rates come from a .toml file"),
        ("a.toml", String::new(), "a.toml: it has no tables"),
        ("a.toml", format!("{table}lru = [1, -2]"), "table 1: lru, frame 1: -2 is not a number of rays"),
        ("a.toml", format!("{table}lru = [nan]"), "table 1: lru, frame 0: NaN is not"),
        ("a.toml", format!("{table}lru = []"), "table 1: lru: it has no frames"),
        ("a.toml", table.into(), "table 1: no policy has rates"),
        ("a.toml", format!("{table}mru = [1]"), "a.toml: line 4: unknown field `mru`, expected one of"),
        ("a.toml", "[[table]]\nbudget = 16\nlru = [1]".into(), "missing field `loading`"),
        ("a.toml", table.replace("sync", "never"), "line 3: unknown variant `never`"),
        ("a.toml", format!("{table}lru = [1]\n").replace("16", "0"), "table 1: budget: 0 is not a share"),
        (
            "a.toml",
            format!("{table}lru = [1]\n{table}fifo = [2]"),
            "tables 1 and 2 are both of 16 % sync cold",
        ),
        ("a.json", "{}".into(), "a.json: this is no report of raypack cache: missing field `tables`"),
        (
            "a.json",
            r#"{"tables": [{"budget": 0.2, "loading": "synchronous", "prefetch": "off", "warm": true,
                "policies": ["lru", "s3-fifo"], "rays_per_s": [[1, 2], [3]]}]}"#
                .into(),
            "a.json: table 1: a frame has not as many rates as there are policies",
        ),
    ] {
        let message = read(name, &text).expect_err(expected).to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{message}");
    }
    let missing = Rates::read(Path::new("no/such.toml")).expect_err("it is not there").to_string();
    assert!(missing.starts_with("cannot read no/such.toml: "), "{missing}");
}

#[test]
fn what_has_nothing_to_stand_beside_is_refused() {
    let text = "[[table]]\nbudget = 16\nloading = \"sync\"\nlru = [500]\n";
    let rates = read("paper.toml", text).expect("a table");
    let trial = |budget, policy, loading| {
        let options = CacheOptions { policy, loading, ..CacheOptions::default() };
        Trial { budget, shape: SHAPE, options }
    };
    let flown = trial(0.16, Replacement::Lru, SYNC);
    let others = [
        trial(0.39, Replacement::Lru, SYNC),
        trial(0.16, Replacement::Fifo, SYNC),
        trial(0.16, Replacement::Lru, ASYNC),
    ];
    let message = rates.check(&others).expect_err("none of them").to_string();
    assert!(
        message.contains("paper.toml: it has nothing of what is flown, but 16 % sync cold;"),
        "{message}"
    );
    rates.check(&[others[0], flown]).expect("one of them");
}
