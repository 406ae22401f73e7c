//! What triangles are made of: read, and looked at before it is handed out.

use super::reader::File;
use super::record::{SurfaceRecord, is_finite};
use super::section::Kind;
use crate::column::Column;
use crate::error::{Error, Result};
use rayon::prelude::*;

/// The index of each triangle's material.
#[derive(Debug)]
pub enum Substances {
    /// By themselves.
    Indices(Column<u32>),
    /// Beside texture coordinates and normals.
    Records(Column<SurfaceRecord>),
}

impl Substances {
    /// That of a triangle. Panics if `primitive` is out of range.
    #[inline]
    pub fn at(&self, primitive: u32) -> u32 {
        match self {
            Self::Indices(indices) => indices[primitive as usize],
            Self::Records(records) => records[primitive as usize].material,
        }
    }

    fn len(&self) -> u32 {
        match self {
            Self::Indices(indices) => indices.len() as u32,
            Self::Records(records) => records.len() as u32,
        }
    }

    /// All of them.
    pub(super) fn to_vec(&self) -> Vec<u32> {
        (0..self.len()).into_par_iter().map(|primitive| self.at(primitive)).collect()
    }

    /// How many triangles have each of so many; what is out of range is not counted.
    fn uses(&self, materials: usize) -> Vec<u64> {
        let none = || vec![0u64; materials];
        let count = |mut uses: Vec<u64>, primitive| {
            if let Some(uses) = uses.get_mut(self.at(primitive) as usize) {
                *uses += 1;
            }
            uses
        };
        let add = |mut sum: Vec<u64>, uses: Vec<u64>| {
            sum.iter_mut().zip(uses).for_each(|(sum, uses)| *sum += uses);
            sum
        };
        (0..self.len()).into_par_iter().fold(none, count).reduce(none, add)
    }
}

impl File {
    /// What triangles are made of, in a scene with materials. Checks the checksums of its section, unless that was
    /// done.
    ///
    /// # Errors
    /// It is damaged, or materials are not those of so many triangles as the file says.
    pub(super) fn substances(&self) -> Result<Substances> {
        self.verify_sections(&[Kind::MaterialOfTriangle, Kind::SurfaceRecords])?;
        let substances = if self.meta().attributes {
            Substances::Records(self.column(Kind::SurfaceRecords))
        } else {
            Substances::Indices(self.column(Kind::MaterialOfTriangle))
        };
        let expected = &self.meta().uses;
        let uses = substances.uses(expected.len());
        if uses.iter().sum::<u64>() < u64::from(substances.len()) {
            return Err(Error::malformed(self.path(), "a triangle has a material that is not there"));
        }
        if uses != *expected {
            return Err(Error::malformed(
                self.path(),
                "its materials have other numbers of triangles than it says; build it again",
            ));
        }
        Ok(substances)
    }

    /// The records of all triangles; none if there are no attributes. Checks the checksums of their section, unless
    /// that was done.
    ///
    /// # Errors
    /// It is damaged, or a texture coordinate is not finite.
    pub(super) fn records(&self) -> Result<Column<SurfaceRecord>> {
        self.verify_sections(&[Kind::SurfaceRecords])?;
        let records: Column<SurfaceRecord> = self.column(Kind::SurfaceRecords);
        if !records.par_iter().all(|record| is_finite(&record.attributes)) {
            return Err(Error::malformed(self.path(), "a texture coordinate of its mesh is not finite"));
        }
        Ok(records)
    }

    /// The triangles whose material gives off light. Checks the checksums of their section, unless that was done.
    ///
    /// # Errors
    /// It is damaged, out of order, or names a triangle that is not there.
    pub fn emitters(&self) -> Result<Column<u32>> {
        self.verify_sections(&[Kind::Emitters])?;
        let emitters: Column<u32> = self.column(Kind::Emitters);
        let ascends = emitters.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascends || emitters.last().is_some_and(|&last| u64::from(last) >= self.meta().triangles) {
            let message = "its emitters are no list of its triangles; build it again";
            return Err(Error::malformed(self.path(), message));
        }
        Ok(emitters)
    }

    /// Whether all of these give off light. Then nothing else does: they are as many as the file says.
    pub(super) fn check_emitters(&self, emitters: &[u32], substances: &Substances) -> Result<()> {
        let materials = self.meta().colors.materials();
        let emits = |&primitive: &u32| materials[substances.at(primitive) as usize].emits();
        if emitters.par_iter().all(emits) {
            return Ok(());
        }
        Err(Error::malformed(self.path(), "an emitter's material gives off no light; build it again"))
    }
}
