//! The neighbours of one point found so far.

use super::tree::LEAF;

/// Up to this number, neighbours are sorted by counting. Decides no answer.
const FEW: usize = 64;

/// Neighbours sorted together when counting. Decides no answer.
const LANES: usize = 8;

/// Squared distances and places of neighbours, unsorted.
pub(super) struct Found {
    pub(super) count: usize,
    distances: Vec<f32>,
    places: Vec<u32>,
}

impl Found {
    /// Allocates room for `wanted` neighbours.
    pub(super) fn new(wanted: usize) -> Self {
        let room = 2 * wanted + 2 * LEAF;
        Self { count: 0, distances: vec![0.0; room], places: vec![0; room] }
    }

    /// Whether the neighbours of another leaf might not fit.
    #[inline]
    pub(super) fn is_full(&self) -> bool {
        self.count + LEAF > self.distances.len()
    }

    /// Adds the places from `first` whose distance is below `bound`; there must be room. Every
    /// place is written, and one that was too far is overwritten by the next, so that there is no
    /// branch to be mispredicted.
    #[inline]
    pub(super) fn add(&mut self, distances: &[f32; LEAF], first: u32, bound: f32) {
        let ends = (self.distances.get_mut(self.count..), self.places.get_mut(self.count..));
        let (Some(distances_end), Some(places_end)) = ends else { return };
        let rooms = (distances_end.first_chunk_mut(), places_end.first_chunk_mut());
        let (Some(to), Some(to_places)) = rooms else { return };
        let (to, to_places): (&mut [f32; LEAF], &mut [u32; LEAF]) = (to, to_places);
        let mut count = 0;
        for (place, &distance) in (first..).zip(distances) {
            // The count is below 16 here; the remainder avoids a bounds check.
            to[count % LEAF] = distance;
            to_places[count % LEAF] = place;
            count += usize::from(distance < bound);
        }
        self.count += count;
    }

    /// Keeps the nearest `wanted`; returns the distance of the farthest of them.
    #[cold]
    pub(super) fn cut(&mut self, wanted: usize) -> f32 {
        let mut keys: Vec<u64> = self.keys().collect();
        let last = *keys.select_nth_unstable(wanted - 1).1;
        self.count = wanted;
        for ((distance, place), key) in
            self.distances.iter_mut().zip(&mut self.places).zip(&keys[..wanted])
        {
            (*distance, *place) = (distance_of(*key), *key as u32);
        }
        distance_of(last)
    }

    /// Writes the nearest neighbours that fit into `out`, in ascending order, as keys.
    pub(super) fn sort_into(&mut self, out: &mut [u64]) {
        if self.count > FEW {
            let mut keys: Vec<u64> = self.keys().collect();
            keys.select_nth_unstable(out.len() - 1);
            out.copy_from_slice(&keys[..out.len()]);
            out.sort_unstable();
            return;
        }
        let ranks = self.ranks();
        let mut sorted = [0; FEW];
        self.keys().zip(ranks).for_each(|(key, rank)| sorted[rank as usize % FEW] = key);
        out.copy_from_slice(&sorted[..out.len()]);
    }

    /// Keys with the bits of the distance above the place: they sort as the distances do.
    fn keys(&self) -> impl Iterator<Item = u64> {
        let found = self.distances.iter().zip(&self.places).take(self.count);
        found.map(|(d, &place)| u64::from(d.to_bits()) << 32 | u64::from(place))
    }

    /// For each distance, the number of those before it; ties in the order found. Comparing all
    /// pairs is faster than sorting, since it is vectorised.
    fn ranks(&mut self) -> [u32; FEW] {
        let mut ranks = [0; FEW];
        let padded = self.count.next_multiple_of(LANES);
        self.distances[self.count..padded].fill(f32::INFINITY);
        let all = self.distances[..padded].as_chunks::<LANES>().0;
        for (block, ranks) in ranks.as_chunks_mut().0.iter_mut().take(all.len()).enumerate() {
            let own = &all[block];
            for other in all[..block].as_flattened() {
                tally(ranks, own, |_, own| other <= own);
            }
            for (i, other) in own.iter().enumerate() {
                tally(ranks, own, |lane, own| if i < lane { other <= own } else { other < own });
            }
            for other in all[block + 1..].as_flattened() {
                tally(ranks, own, |_, own| other < own);
            }
        }
        ranks
    }
}

#[inline]
fn tally(ranks: &mut [u32; LANES], own: &[f32; LANES], before: impl Fn(usize, &f32) -> bool) {
    for (lane, (rank, own)) in ranks.iter_mut().zip(own).enumerate() {
        *rank += u32::from(before(lane, own));
    }
}

/// The distance in a key.
#[inline]
pub(super) fn distance_of(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}
