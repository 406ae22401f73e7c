//! NumPy's file formats by hand, after their descriptions (NEP 1 and APPNOTE.TXT).

/// A `.npy` file of rows of eight float32, as `numpy.save` writes it.
pub fn npy(rows: &[[f32; 8]]) -> Vec<u8> {
    let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    npy_of(1, "'<f4'", false, &format!("({}, 8)", rows.len()), &bytes)
}

/// A `.npy` file: version, type and shape as Python writes them, and the items' bytes.
pub fn npy_of(version: u8, descr: &str, fortran: bool, shape: &str, items: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}");
    let start = if version == 1 { 10 } else { 12 };
    // Spaces and a line end fill the header up to a multiple of 64 bytes.
    let length = (start + header.len() + 1).next_multiple_of(64) - start;
    let mut file = b"\x93NUMPY".to_vec();
    file.extend([version, 0]);
    if version == 1 {
        file.extend((length as u16).to_le_bytes());
    } else {
        file.extend((length as u32).to_le_bytes());
    }
    file.extend(format!("{header:0$}\n", length - 1).bytes());
    file.extend(items);
    file
}

/// An array of a `.npz` file.
struct Array {
    name: String,
    descr: String,
    shape: Vec<usize>,
    items: Vec<u8>,
}

/// The arrays of a `.npz` file whose entries are stored.
pub struct Npz(Vec<Array>);

impl Npz {
    /// Takes a file apart, by the directory at its end.
    pub fn parse(file: &[u8]) -> Self {
        let end = &file[file.len() - 22..];
        assert_eq!(&end[..4], b"PK\x05\x06", "the archive's end has no comment");
        let (entries, mut at) = (u16_at(end, 10), u32_at(end, 16) as usize);
        let mut arrays = Vec::new();
        for _ in 0..entries {
            let entry = &file[at..];
            assert_eq!(&entry[..4], b"PK\x01\x02");
            assert_eq!(u16_at(entry, 10), 0, "stored");
            let [name, extra, comment] = [28, 30, 32].map(|field| u16_at(entry, field));
            let size = u32_at(entry, 24) as usize;
            assert_eq!(u32_at(entry, 20) as usize, size, "stored: as large as before");
            let local = &file[u32_at(entry, 42) as usize..];
            assert_eq!(&local[..4], b"PK\x03\x04");
            let start = 30 + u16_at(local, 26) + u16_at(local, 28);
            let file_name = String::from_utf8(entry[46..46 + name].to_vec()).expect("a name");
            let data = &local[start..start + size];
            assert_eq!(u32_at(entry, 16), crc32(data), "{file_name}");
            arrays.push(Array::parse(file_name.strip_suffix(".npy").expect("an array"), data));
            at += 46 + name + extra + comment;
        }
        Self(arrays)
    }

    /// Names in order.
    pub fn names(&self) -> Vec<&str> {
        self.0.iter().map(|array| array.name.as_str()).collect()
    }

    /// An array's shape.
    pub fn shape(&self, name: &str) -> &[usize] {
        &self.array(name).shape
    }

    /// The items of a float32 array.
    pub fn f32s(&self, name: &str) -> Vec<f32> {
        let items = self.items(name, "<f4").as_chunks().0;
        items.iter().map(|&item| f32::from_le_bytes(item)).collect()
    }

    /// The items of an int64 array.
    pub fn i64s(&self, name: &str) -> Vec<i64> {
        let items = self.items(name, "<i8").as_chunks().0;
        items.iter().map(|&item| i64::from_le_bytes(item)).collect()
    }

    /// The items of a bool array.
    pub fn bools(&self, name: &str) -> Vec<bool> {
        self.items(name, "|b1").iter().map(|&item| item == 1).collect()
    }

    fn array(&self, name: &str) -> &Array {
        self.0.iter().find(|array| array.name == name).expect("the array is there")
    }

    fn items(&self, name: &str, descr: &str) -> &[u8] {
        let array = self.array(name);
        assert_eq!(array.descr, descr, "{name}");
        &array.items
    }
}

impl Array {
    fn parse(name: &str, file: &[u8]) -> Self {
        assert_eq!(&file[..8], b"\x93NUMPY\x01\x00");
        let start = 10 + u16_at(file, 8);
        assert!(start.is_multiple_of(64) && file[start - 1] == b'\n', "{name}: the header is aligned");
        let header = std::str::from_utf8(&file[10..start]).expect("text");
        let after = |key: &str| header.split_once(&format!("'{key}': ")).expect("a key").1;
        assert!(after("fortran_order").starts_with("False"), "{name}");
        let descr = after("descr").split('\'').nth(1).expect("a type").to_owned();
        let shape = after("shape").trim_start_matches('(').split_once(')').expect("a tuple").0;
        let shape: Vec<usize> = shape
            .split(',')
            .map(str::trim)
            .filter(|side| !side.is_empty())
            .map(|side| side.parse().expect("a number"))
            .collect();
        let items = file[start..].to_vec();
        let size: usize = descr[2..].parse().expect("a size");
        assert_eq!(items.len(), shape.iter().product::<usize>() * size, "{name}");
        Self { name: name.to_owned(), descr, shape, items }
    }
}

fn u16_at(bytes: &[u8], at: usize) -> usize {
    u16::from_le_bytes([bytes[at], bytes[at + 1]]).into()
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}
