//! Scene files of which a part is in memory, on the command line: the same pictures, within the memory given,
//! and clear errors where that does not do.

mod common;

use common::Place;

/// A folder with the scene file of a plant.
fn place(triangles: u32) -> Place {
    let place = Place::new();
    place.succeed(&format!("generate plant --triangles {triangles} --seed 5 -o plant.ply"));
    place.succeed("build plant.ply -o plant.rpk");
    place
}

const VIEW: &str = "--size 160x120 --threads 2 --orbit 3";

#[test]
fn pictures_are_the_same_within_the_memory_given() {
    let place = place(400_000);
    place.succeed(&format!("render plant.rpk -o whole.png {VIEW}"));
    // What the process takes anyway is in it, so that a debug build has to have some room.
    const BUDGET: u64 = 48 << 20;
    for how in [
        "",
        "--prefetch off",
        "--prefetch ahead --policy lru --loaders 3",
        "--loading sync --policy lru --block 16384",
        "--nodes 0.3:fifo --ways 4 --stripes 3",
    ] {
        place.succeed(&format!("render plant.rpk -o part.png {VIEW} --memory 48MiB {how} --json part.json"));
        for frame in 0..3 {
            let [part, whole] = ["part", "whole"].map(|name| place.read(&format!("{name}_00{frame}.png")));
            assert!(part == whole, "frame {frame} {how}");
        }
        let report = place.json("part.json");
        let cache = &report["cache"];
        let number = |key: &str| cache[key].as_u64().unwrap_or_else(|| panic!("{key} in {cache}"));
        assert_eq!(number("budget"), BUDGET);
        assert!(number("data") > 30 << 20, "the scene is too small for this test: {cache}");
        assert!(number("peak_blocks") < number("data"), "{cache}");
        assert!(number("loads") > 0 && number("bytes_read") >= number("loads") * 1000, "{cache}");
        let hits = cache["hit_ratio"].as_f64().expect("a share");
        assert!((0.3..1.0).contains(&hits), "{cache}");
        if cfg!(target_os = "linux") {
            assert!(number("peak_resident") <= BUDGET, "{how}: {cache}");
        }
    }
    let text = place.succeed("render plant.rpk -o part.png --size 64x48 --memory 48MiB");
    assert!(text.contains("of 48.0 MiB at most") && text.contains("% of uses hit"), "{text}");
}

#[test]
fn every_render_and_cast_ends_with_the_memory_given_and_taken() {
    let place = place(20_000);
    let ends = |text: &str| text.lines().last().expect("lines").to_owned();
    for scene in ["plant.ply", "plant.rpk", ""] {
        for what in ["", "--orbit 2", "--heatmap steps"] {
            let options = format!("-o out.png --size 32x24 {what} --json out.json");
            let last = ends(&place.succeed(&format!("render {scene} {options}")));
            assert!(last.starts_with("memory ") && last.ends_with(" at most; no budget was given"), "{last}");
            let memory = place.json("out.json")["memory"].clone();
            assert!(memory["budget"].is_null() && memory["announced"].is_null(), "{memory}");
            assert!(
                !cfg!(target_os = "linux") || memory["peak_resident"].as_u64() > Some(1 << 20),
                "{memory}"
            );
        }
    }
    let text = place.succeed("render plant.ply -o out.png --size 32x24 --memory 1GiB --json out.json");
    let last = ends(&text);
    assert!(last.starts_with("memory ") && last.contains(" of 1.00 GiB at most, "), "{last}");
    let memory = place.json("out.json")["memory"].clone();
    assert_eq!(memory["budget"], 1 << 30);
    assert!(memory["announced"].as_u64() > Some(1 << 20), "{memory}");
}

#[test]
fn a_model_within_memory_is_covered_with_its_picture_and_all_else() {
    let place = Place::new();
    place.succeed("generate plant --triangles 60000 --seed 5 -o plant.ply");
    let render = |size: &str, memory: &str| {
        format!("render plant.ply -o out.png --size {size} --threads 2 --memory {memory} --json out.json")
    };
    let least = |size: &str| {
        let refused = place.raypack(&render(size, "1MiB")).assert().code(1).get_output().clone();
        let message = String::from_utf8(refused.stderr).expect("text");
        let given = message.split("give ").nth(1).and_then(|rest| rest.split("MiB").next());
        given.and_then(|number| number.parse::<u64>().ok()).unwrap_or_else(|| panic!("{message}"))
    };
    // The picture counts: 4 million pixels more, of 28 bytes.
    let [small, large] = ["64x64", "2000x2000"].map(least);
    assert!((large - small).abs_diff(107) < 12, "{small} and {large}");
    // Before a model is read, what its vertices take that nothing uses counts as well; and some of the least may go on.
    for (size, memory) in [("64x64", small + 2), ("2000x2000", large + 2)] {
        let text = place.succeed(&render(size, &format!("{memory}MiB")));
        let report = place.json("out.json")["memory"].clone();
        let number = |key: &str| report[key].as_u64().unwrap_or_else(|| panic!("{key} in {report}"));
        assert_eq!(number("budget"), memory << 20);
        assert!(number("announced") <= memory << 20, "{report}");
        assert!(!cfg!(target_os = "linux") || number("peak_resident") <= memory << 20, "{report}");
        assert!(text.lines().last().expect("lines").starts_with("memory "), "{text}");
    }
    place.fail(&render("64x64", "8MiB"), &["--memory: the process, the model", "MiB, or make a .rpk"]);
}

#[test]
fn two_caches_are_told_apart() {
    let place = place(400_000);
    let options = format!("{VIEW} --memory 48MiB --json part.json");
    let text = place.succeed(&format!("render plant.rpk -o part.png {options} --nodes 0.3:fifo"));
    let cache = place.json("part.json")["cache"].clone();
    let caches = cache["caches"].as_array().expect("two");
    let number =
        |of: &serde_json::Value, key: &str| of[key].as_u64().unwrap_or_else(|| panic!("{key} in {of}"));
    let [nodes, leaves] = &caches[..] else { panic!("{cache}") };
    assert_eq!([&nodes["of"], &leaves["of"]], ["nodes", "leaves"]);
    assert_eq!(nodes["policy"], "fifo");
    for key in ["uses", "misses", "loads", "bytes_read", "evictions"] {
        assert_eq!(number(nodes, key) + number(leaves, key), number(&cache, key), "{key} in {cache}");
    }
    for one in [nodes, leaves] {
        assert!(number(one, "loads") > 0 && number(one, "uses") > number(one, "misses"), "{one}");
        let (uses, misses) = (number(one, "uses") as f64, number(one, "misses") as f64);
        assert!((one["hit_ratio"].as_f64().expect("a share") - (1.0 - misses / uses)).abs() < 1e-9, "{one}");
    }
    let share = number(nodes, "bytes") as f64 / (number(nodes, "bytes") + number(leaves, "bytes")) as f64;
    assert!((0.27..0.33).contains(&share), "{cache}");
    for of in ["nodes: fifo in ", "leaves: "] {
        let line = text.lines().find(|line| line.contains(of)).unwrap_or_else(|| panic!("{of} in {text}"));
        assert!(line.contains("% of uses hit, ") && line.contains(" read"), "{line}");
    }
    place.succeed(&format!("render plant.rpk -o part.png {options}"));
    assert!(place.json("part.json")["cache"]["caches"].is_null());
}

#[test]
fn several_processes_share_a_scene_file() {
    let place = place(400_000);
    place.succeed(&format!("render plant.rpk -o whole.png {VIEW}"));
    let names = ["one", "two", "three"];
    let render = |name| place.process(&format!("render plant.rpk -o {name}.png --memory 48MiB {VIEW}"));
    for mut process in names.map(|name| render(name).spawn().expect("it starts")) {
        assert!(process.wait().expect("it ends").success());
    }
    for frame in 0..3 {
        let whole = place.read(&format!("whole_00{frame}.png"));
        for name in names {
            assert!(place.read(&format!("{name}_00{frame}.png")) == whole, "{name}, frame {frame}");
        }
    }
}

#[test]
fn what_comes_before_it_is_needed_changes_no_picture() {
    let place = place(400_000);
    place.succeed(&format!("render plant.rpk -o whole.png {VIEW}"));
    // From the disk, so that blocks have to be waited for, where the system can read so.
    let can =
        place.raypack("render plant.rpk -o part.png --memory 48MiB --direct").output().expect("it runs");
    let direct = if can.status.success() { "--direct" } else { "" };
    for how in ["--loaders 1", "--policy fifo --ways 3", "--nodes 0.3:lru", "--block 16384"] {
        let options = format!("--memory 48MiB --tile 8 --prefetch ahead {how} {direct} --json part.json");
        let text = place.succeed(&format!("render plant.rpk -o part.png {VIEW} {options}"));
        for frame in 0..3 {
            let [part, whole] = ["part", "whole"].map(|name| place.read(&format!("{name}_00{frame}.png")));
            assert!(part == whole, "frame {frame} {how}");
        }
        let cache = place.json("part.json")["cache"].clone();
        let number = |key: &str| cache[key].as_u64().unwrap_or_else(|| panic!("{key} in {cache}"));
        assert!(number("prefetched_used") + number("prefetched_unused") <= number("prefetched"), "{cache}");
        assert_eq!(cache["options"]["prefetch"], "ahead", "{cache}");
        let told = text.contains("blocks came before they were needed: ");
        assert_eq!(told, number("prefetched") > 0, "{text}");
    }
}

#[test]
fn a_first_picture_is_written_beside_the_frame() {
    let place = place(150_000);
    place.succeed("render plant.rpk -o whole.png --size 160x120");
    let options = "--size 160x120 --memory 48MiB --first-within 1";
    let text = place.succeed(&format!("render plant.rpk -o part.png {options} --json part.json"));
    assert!(text.contains("pixels drawn as boxes: part.first.png"), "{text}");
    assert!(place.read("part.png") == place.read("whole.png") && !place.read("part.first.png").is_empty());
    let first = place.json("part.json")["frames"][0]["first"].clone();
    let stand_ins = first["stand_ins"].as_f64().expect("a part");
    assert!(stand_ins > 0.0 && stand_ins <= 1.0 && first["file"] == "part.first.png", "{first}");
    place.succeed(&format!("render plant.rpk -o path.png {options} --orbit 2"));
    assert!(!place.read("path_001.first.png").is_empty());
    let refused = "render plant.rpk -o out.png --memory 48MiB --first-within 0";
    place.fail(refused, &["--first-within: 0 is no time"]);
    let refused = "render plant.ply -o out.png --memory 48MiB --first-within 9";
    place.fail(refused, &["--first-within: only of a .rpk scene file"]);
}

/// The least memory in MiB that a refusal of less names.
fn least(place: &Place, command: &str) -> u64 {
    let refused = place.raypack(&format!("{command} --memory 1MiB")).assert().code(1).get_output().clone();
    let message = String::from_utf8(refused.stderr).expect("text");
    let least = message.split("it takes at least ").nth(1).and_then(|rest| rest.split(' ').next());
    least.and_then(|least| least.parse().ok()).unwrap_or_else(|| panic!("{command}: {message}"))
}

#[test]
fn the_least_memory_that_a_refusal_names_does() {
    let place = place(150_000);
    let gallery = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/gallery");
    place.succeed(&format!("build {gallery}/gallery.obj -o gallery.rpk"));
    // A sky of some megabytes.
    let sky: Vec<u8> = (0..512 * 256 * 3).map(|i: u32| (i / 4001 % 256) as u8).collect();
    let sky = image::RgbImage::from_raw(512, 256, sky).expect("all texels");
    sky.save(place.path("sky.png")).expect("written");
    let effects = "--effects +ambient-occlusion --samples 2";
    for command in [
        "render plant.rpk -o part.png --size 160x120".to_owned(),
        "render plant.rpk -o part.png --size 160x120 --loading sync --orbit 2".to_owned(),
        "render plant.rpk -o part.png --size 160x120 --first-within 5".to_owned(),
        "render gallery.rpk -o part.png --size 160x120 --samples 2".to_owned(),
        format!("render gallery.rpk -o part.png --size 160x120 {effects} --environment sky.png"),
        format!("render plant.rpk -o part.png --size 80x60 {effects}"),
    ] {
        let whole = command.replace("part.png", "whole.png").replace(" --loading sync", "");
        let whole = whole.replace(" --first-within 5", "");
        place.succeed(&whole);
        let least = least(&place, &command);
        place.succeed(&format!("{command} --memory {least}MiB --json part.json"));
        let name = if command.contains("orbit") { "_001.png" } else { ".png" };
        let [part, whole] = ["part", "whole"].map(|picture| place.read(&format!("{picture}{name}")));
        assert!(part == whole, "{command} within {least} MiB");
        let cache = place.json("part.json")["cache"].clone();
        if cfg!(target_os = "linux") {
            let peak = cache["peak_resident"].as_u64().expect("the system says");
            assert!(peak <= least << 20, "{command} within {least} MiB: {cache}");
        }
        // It is the least but for a little that differs from run to run.
        let below = format!("{command} --memory {}MiB", least - 3);
        place.fail(&below, &["--memory: ", "is too little for this scene"]);
    }
}

#[test]
fn too_little_memory_and_nonsense_are_refused_beforehand() {
    let place = place(20_000);
    for (options, expected) in [
        ("--memory 1MiB", &["--memory: 1 MiB is too little for this scene: it takes at least"][..]),
        ("--memory much", &["--memory: \"much\" is no size"]),
        ("--memory 1GiB --policy mru", &["--policy: \"mru\" is none of fifo, lru"]),
        ("--memory 1GiB --block 5000", &["--block: 5000 is not a power of two"]),
        ("--memory 1GiB --ways 0", &["--ways: 0"]),
        ("--memory 1GiB --loading never", &["--loading: \"never\" is neither async nor sync"]),
        ("--memory 1GiB --prefetch maybe", &["--prefetch: \"maybe\" is not one of off, beside, ahead"]),
        ("--memory 1GiB --prefetch beside --loading sync", &["--prefetch: blocks come", "--loading async"]),
        ("--memory 1GiB --nodes 2:lru", &["--nodes: 2 is not a share"]),
        ("--memory 1GiB --nodes half", &["--nodes: \"half\" is not PART:POLICY"]),
        ("--memory 1GiB --accuracy fast", &["--accuracy: fast keeps a record of every triangle"]),
        ("--memory 1GiB --heatmap steps", &["--heatmap: it walks a tree that is all in memory"]),
    ] {
        place.fail(&format!("render plant.rpk -o out.png {options}"), expected);
    }
    place.fail(
        "cache plant.ply",
        &["plant.ply: unknown kind of file (.ply); a cache needs a .rpk scene file"],
    );
    place.fail("cache plant.rpk --policies lru,best", &["--policies: \"best\" is none of"]);
    place.fail("cache plant.rpk --budgets 0", &["--budgets: 0 is not a share"]);
    place.fail("cache plant.rpk --ways 8,0", &["--ways: 0 is not a number of blocks"]);
    place.fail("cache plant.rpk --stripes 0,8", &["--stripes: 0 is not a number of locks"]);
    place.fail("cache plant.rpk --block 512,5000", &["--block: 5000 is not a power of two"]);
    place.fail("cache plant.rpk --nodes none,2", &["--nodes: 2 is not a share"]);
    place.fail("cache plant.rpk --nodes 0.3:mru", &["--nodes: \"0.3:mru\" is not PART:POLICY"]);
    place.fail("cache plant.rpk --beside rates.csv", &["rates.csv: unknown kind of file (.csv); rates come"]);
    place.fail("cache plant.rpk --beside no.toml", &["cannot read no.toml: "]);
    let table = "[[table]]\nbudget = 12\nloading = \"sync\"\nlru = [1]\n";
    place.write("other.toml", table.as_bytes());
    place.fail("cache plant.rpk --beside other.toml", &["other.toml: it has nothing", "but 12 % sync cold"]);
    place.fail(
        "cache plant.rpk --beside a.json --json a.json",
        &["--beside: the report would be written over"],
    );
    place.fail("cache plant.rpk --warm 0", &["--warm: 0 is not a number of flights"]);
    place.fail("cache plant.rpk --frames 0", &["--frames: 0"]);
    place.fail("cache plant.rpk --plot out.gif", &["out.gif: unknown kind of file"]);
    place.fail("cache plant.rpk --budgets 1", &["--memory: ", "is too little for this scene"]);
}

#[test]
fn a_block_that_is_damaged_ends_the_frame_with_its_place() {
    let place = place(50_000);
    // A bit in each block of the triangles, which lie at the place that info tells.
    place.succeed("info plant.rpk --json info.json");
    let info = place.json("info.json");
    let sections = info["file"]["sections"].as_array().expect("sections");
    let triangles = sections.iter().find(|section| section["kind"] == "triangles").expect("has triangles");
    let [offset, bytes] = ["offset", "bytes"].map(|key| triangles[key].as_u64().expect(key) as usize);
    let mut file = place.read("plant.rpk");
    for block in (offset..offset + bytes).step_by(4096) {
        file[block + 7] ^= 4;
    }
    place.write("damaged.rpk", &file);
    for loading in ["sync", "async"] {
        place.fail(
            &format!("render damaged.rpk -o out.png --size 64x48 --memory 1GiB --loading {loading}"),
            &["damaged.rpk: its triangles are damaged at byte", "build it again"],
        );
    }
}

#[test]
fn a_flight_tells_what_each_cache_did() {
    let place = place(150_000);
    let text = place.succeed(
        "cache plant.rpk --frames 3 --size 96x96 --budgets 40,400 --policies lru,sieve --loading sync,async \
         --prefetch off,beside,ahead --loaders 3 --warm 2 --threads 2 --json flight.json --plot flight.svg",
    );
    assert!(text.is_empty() || text.contains("resident"), "{text}");
    let report = place.json("flight.json");
    assert_eq!(report["warm_flights"], 2);
    assert_eq!(report["shadows"], false, "camera rays alone, as in the paper");
    let rows = report["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 1 + 2 * 2 * (1 + 3) * 2, "shares, policies, ways of loading, cold and warm");
    let ahead = rows.iter().filter(|row| row["cache"]["prefetch"] == "ahead");
    assert_eq!(ahead.count(), 2 * 2 * 2, "shares, policies, cold and warm");
    assert!(rows[0]["policy"].is_null() && rows[0]["rays_per_s"].as_f64().expect("a rate") > 0.0);
    let blocks = report["data_bytes"].as_u64().expect("a number") / 4096 + 5;
    let mut cold_loads = 0;
    for row in &rows[1..] {
        let number = |key: &str| row[key].as_u64().unwrap_or_else(|| panic!("{key} in {row}"));
        assert_eq!(row["frames"].as_array().expect("frames").len(), 3);
        assert!(number("minimum") <= number("loads") + number("held"), "{row}");
        let seconds = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"));
        assert!(seconds("frame_p50") <= seconds("frame_p99"), "{row}");
        assert!(0.0 < seconds("tile_p50") && seconds("tile_p50") <= seconds("tile_p99"), "{row}");
        let warm = row["warm"].as_bool().expect("warm or not");
        let evictions = |frame: &serde_json::Value| frame["cache"]["evictions"].as_u64().expect("a number");
        let evicted: u64 = row["frames"].as_array().expect("frames").iter().map(evictions).sum();
        if row["budget"].as_f64().expect("a share") > 1.0 {
            // Everything fits: what was read once is not read again, unless it came too early and was given up.
            assert_eq!(evicted, 0, "{row}");
            if row["cache"]["prefetch"] == "ahead" {
                continue;
            }
            cold_loads = number("loads") + if warm { cold_loads } else { 0 };
            assert!(cold_loads <= blocks, "{row}");
        }
    }
    // As in the paper: a table for each share and way of loading, of a row a frame and a column a policy.
    let tables = report["tables"].as_array().expect("a list");
    assert_eq!(tables.len(), 2 * (1 + 3) * 2, "shares, ways of loading, cold and warm");
    assert_eq!(tables.iter().filter(|table| table["prefetch"] == "ahead").count(), 2 * 2);
    for table in tables {
        assert_eq!(table["policies"], serde_json::json!(["lru", "sieve"]), "{table}");
        let rows = table["rays_per_s"].as_array().expect("a list");
        let is_whole = |row: &serde_json::Value| row.as_array().is_some_and(|rates| rates.len() == 2);
        assert!(rows.len() == 3 && rows.iter().all(is_whole), "{table}");
    }
    assert_eq!(report["paper"]["rays_per_s"], serde_json::json!([3e3, 12e3]));
    for line in [
        "rays/s by frame, 40 % in memory, sync, cold",
        "rays/s by frame, 40 % in memory, async, cold",
        "rays/s by frame, 40 % in memory, beside, cold",
        "rays/s by frame, 40 % in memory, ahead, warm",
        "frame  ",
        "3 to 12 thousand rays/s, 21 s for a frame",
    ] {
        assert!(text.contains(line), "{line:?} is not in:\n{text}");
    }
    let plot = String::from_utf8(place.read("flight.svg")).expect("text");
    assert!(plot.contains("40 % in memory, warm") && plot.contains("sieve async"), "it is a plot");
    for label in ["0", "1", "2"] {
        assert!(plot.contains(&format!(">\n{label}\n</text>")), "frame {label} is named as in the tables");
    }
    let reads = |number: &serde_json::Value| grouped(number.as_u64().expect("a number"));
    for row in &rows[1..] {
        let figures = format!("{}, least {}, ", reads(&row["loads"]), reads(&row["minimum"]));
        assert!(plot.contains(&figures) && plot.contains("% hits"), "{figures} is not in the plot");
    }
}

/// `1,234,567`.
fn grouped(number: u64) -> String {
    if number < 1000 {
        number.to_string()
    } else {
        format!("{},{:03}", grouped(number / 1000), number % 1000)
    }
}

#[test]
fn caches_of_all_kinds_are_flown_and_kept_apart() {
    let place = place(60_000);
    let flight = "cache plant.rpk --frames 2 --size 64x64 --budgets 150 --policies fifo,lru --loading sync";
    let text = place.succeed(&format!(
        "{flight} --ways 1,16 --stripes 1,4 --block 1024,4096 --nodes none,0.4,0.4:lru --json kinds.json --plot kinds.svg"
    ));
    let report = place.json("kinds.json");
    let rows = report["rows"].as_array().expect("rows");
    let kinds = 2 * 2 * 2 * 3;
    assert_eq!(rows.len(), 1 + kinds * 2 * 2, "kinds, policies, cold and warm");
    for row in &rows[1..] {
        let (shape, cache) = (&row["shape"], &row["cache"]);
        for key in ["ways", "stripes", "block"] {
            assert!(shape[key].is_u64() && shape[key] == cache[key], "{row}");
        }
        let policy =
            if shape["nodes"]["policy"].is_null() { &row["policy"] } else { &shape["nodes"]["policy"] };
        let has_nodes = !shape["nodes"].is_null();
        assert_eq!(cache["nodes"].is_array(), has_nodes, "{row}");
        assert!(!has_nodes || cache["nodes"][1] == *policy, "{row}");
    }
    let tables = report["tables"].as_array().expect("tables");
    assert_eq!(tables.len(), kinds * 2, "kinds, cold and warm");
    for (at, table) in tables.iter().enumerate() {
        assert_eq!(table["policies"], serde_json::json!(["fifo", "lru"]), "{table}");
        let is_like = |other: &serde_json::Value| {
            (&other["shape"], &other["warm"]) == (&table["shape"], &table["warm"])
        };
        assert!(!tables[..at].iter().any(is_like), "no two are of one kind: {table}");
    }
    let head = text.lines().find(|line| line.starts_with("in memory")).expect("a heading");
    let words: Vec<&str> = head.split_whitespace().collect();
    assert!(words.windows(4).any(|words| words == ["block", "ways", "stripes", "nodes"]), "{head}");
    assert!(
        text.contains("150 % in memory, sync, cold, block 1024, ways 1, stripes 4, nodes 0.4:lru"),
        "{text}"
    );
    let plot = String::from_utf8(place.read("kinds.svg")).expect("text");
    assert!(
        plot.contains("150 % in memory, warm, block 4096, ways 16, stripes 1, nodes none"),
        "it is a plot"
    );

    // One kind needs no columns; and there may be shadows.
    let text = place.succeed(&format!("{flight} --ways 4 --shadows --json one.json"));
    let head = text.lines().find(|line| line.starts_with("in memory")).expect("a heading");
    assert!(!head.contains("ways") && text.contains("camera and shadow rays"), "{text}");
    let report = place.json("one.json");
    assert_eq!((&report["rows"][1]["cache"]["ways"], &report["shadows"]), (&4.into(), &true.into()));
    place.succeed(&format!("{flight} --no-shadows"));

    // As elsewhere, a part alone has the policy of the other cache.
    let options = "--memory 1GiB --nodes 0.25 --policy clock --json part.json";
    place.succeed(&format!("render plant.rpk -o part.png --size 64x48 {options}"));
    let nodes = place.json("part.json")["cache"]["options"]["nodes"].clone();
    assert_eq!(nodes, serde_json::json!([0.25, "clock"]));
}

#[test]
fn rates_from_elsewhere_stand_beside_ours() {
    let place = place(60_000);
    let flight = "cache plant.rpk --frames 2 --size 64x64 --budgets 150 --policies fifo,lru --loading sync";
    place.succeed(&format!("{flight} --json earlier.json"));
    let earlier = place.json("earlier.json");
    // Made up: nobody measured these.
    let typed = "[[table]]\nbudget = 150\nloading = \"sync\"\nlru = [1000, 2500]\nclock = [1, 2]\n\
                 [[table]]\nbudget = 150\nloading = \"sync\"\npass = \"warm\"\nfifo = [500]\n";
    place.write("typed.toml", typed.as_bytes());
    let text = place.succeed(&format!("{flight} --beside typed.toml --json ours.json"));
    assert!(
        text.contains("beside typed.toml, table 1: rays/s") && text.contains("lru ours  beside  ratio"),
        "{text}"
    );
    let ours = place.json("ours.json");
    let [cold, warm] = [0, 1].map(|at| ours["tables"][at].clone());
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("a number: {value}"));
    let columns = cold["beside"]["policies"].as_array().expect("columns");
    assert_eq!((columns.len(), &columns[0]["policy"]), (1, &"lru".into()), "what both have: {cold}");
    for (frame, theirs) in [1000.0, 2500.0].into_iter().enumerate() {
        assert_eq!(number(&columns[0]["beside"][frame]), theirs);
        let rate = number(&cold["rays_per_s"][frame][1]);
        assert_eq!(number(&columns[0]["ours"][frame]), rate);
        assert_eq!(number(&columns[0]["ratio"][frame]), rate / theirs);
        assert_eq!(number(&cold["times_paper"][frame][1]), rate / 12e3);
    }
    let column = &warm["beside"]["policies"][0];
    assert_eq!(column["policy"], "fifo");
    assert!(number(&column["beside"][0]) == 500.0 && column["beside"][1].is_null(), "{warm}");

    // An earlier report is such a file, too.
    place.succeed(&format!("{flight} --beside earlier.json --json ours.json"));
    let ours = place.json("ours.json");
    for (ours, earlier) in [0, 1].map(|at| (&ours["tables"][at], &earlier["tables"][at])) {
        for policy in [0, 1] {
            let column = &ours["beside"]["policies"][policy];
            for frame in [0, 1] {
                assert_eq!(column["beside"][frame], earlier["rays_per_s"][frame][policy], "{ours}");
            }
        }
    }
}
