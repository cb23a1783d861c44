//! All poses at once, with the floor as one smooth surface, and how well they are known.
//!
//! Unknown are the pose of every frame, an offset of its ranges, the offset that all frames have in
//! common, and the plane of the floor. A surfel's height is whatever the frames that saw it agree
//! on; that of the floor is also near its plane, as far as the floor is even. A camera that
//! measures all ranges too long by 4 mm sees a floor that is curved and, moved along it, too little
//! of its own way: that the same place is seen from several angles tells how much.

use nalgebra::{DVector, Matrix3, Vector3};

use crate::robust::scale;

use super::links::{Link, Sight, links};
use super::motion::Motion;
use super::normal_equations::{NormalEquations, Row, Solved, WIDTH};
use super::track::{Kept, Tracker, floor};

/// The poses of all frames, and how well they are known.
#[derive(Debug, Clone)]
pub struct Joint {
    /// From each frame to the scan, whose floor is z = 0; none where it was left out.
    pub poses: Vec<Option<Motion>>,
    /// What is added to the ranges of each frame.
    pub offsets_m: Vec<f64>,
    /// What all frames have in common of it, and its standard uncertainty.
    pub offset_m: f64,
    /// Standard uncertainty of `offset_m`.
    pub u_offset_m: f64,
    /// Standard deviation of the frames about their mean, over places a few cubes wide.
    pub between_m: f64,
    /// Standard uncertainty of a height above the floor that is common to such a place.
    pub u_height_m: f64,
    /// Root mean square departure of the floor from its plane.
    pub uneven_m: f64,
    /// Pairs of frames that are not neighbours in time, and see the same.
    pub loops: usize,
    /// Whether a floor was in view.
    pub has_floor: bool,
}

/// Rounds, each with new links, and steps of each.
const ROUNDS: usize = 3;
const STEPS: usize = 2;
/// Standard uncertainty of a depth camera's offset: Microsoft gives 11 mm as its largest.
const OFFSET_M: f64 = 0.006;
/// Standard deviation of a frame's own offset about it.
const OWN_OFFSET_M: f64 = 0.001;
/// Frames move by so little from where they were laid, in metres and radians.
const LAID: f64 = 0.05;
/// Weight that holds the first frame.
const HELD: f64 = 1e12;
/// Departures of surfels that no pixel's noise explains, at first.
const UNEXPLAINED_M: f64 = 3e-4;
/// A residual of more standard deviations counts less.
const HUBER: f64 = 3.0;
/// A floor's unevenness is alike over this part of the range.
const ALIKE: f64 = 0.2;
/// The floor is within this part of the range of its plane, and so many degrees (cosine) of it.
const FLOOR: f64 = 0.015;
const LEVEL: f64 = 0.985;
/// No floor is more even.
const EVEN_M: f64 = 3e-4;
/// Places at which heights are asked for their uncertainty.
const ASKED: usize = 48;
/// Frames that share so many surfels see the same.
const SHARED: usize = 200;
/// A patch belongs to a surfel within this part of a cube along the normal, at first and later.
const ALONG: f64 = 0.5;
const SETTLED: f64 = 0.2;
/// Most frames that are solved for at once; of more, every so many.
const MOST: usize = 64;

impl Tracker {
    /// Solves for all poses.
    ///
    /// `is_exact`: the poses were given as they are, and only their offsets are sought.
    #[must_use]
    pub fn solve(&mut self, is_exact: bool) -> Joint {
        let cube_m = self.cube_m();
        let mut state = State::new(self, is_exact);
        for _ in 0..ROUNDS {
            state.level(&mut self.frames);
            let found = state.links(&self.frames, cube_m, &self.noise());
            for _ in 0..STEPS {
                state.step(&mut self.frames, &found);
            }
            state.learn(&self.frames, &found);
            state.is_settled = true;
        }
        state.level(&mut self.frames);
        let found = state.links(&self.frames, cube_m, &self.noise());
        state.step(&mut self.frames, &found);
        state.level(&mut self.frames);
        state.joint(&self.frames, &found)
    }
}

struct State {
    offsets_m: Vec<f64>,
    offset_m: f64,
    /// Height and slopes of the floor's plane.
    plane: Vector3<f64>,
    has_floor: bool,
    unexplained_m: f64,
    uneven_m: f64,
    range_m: f64,
    cube_m: f64,
    threads: usize,
    is_exact: bool,
    /// Where among the unknowns each frame's stand; none of those that are not solved for.
    places: Vec<Option<usize>>,
    unknowns: usize,
    solved: Option<Solved>,
    /// Whether the frames lie so near that what does not fit is something else.
    is_settled: bool,
}

impl State {
    fn new(tracker: &Tracker, is_exact: bool) -> Self {
        let placed = tracker.frames.iter().flatten().count();
        let every = placed.div_ceil(MOST).max(1);
        let mut count = 0;
        let places: Vec<Option<usize>> = tracker
            .frames
            .iter()
            .map(|kept| {
                kept.as_ref()?;
                count += 1;
                ((count - 1) % every == 0).then(|| (count - 1) / every * WIDTH)
            })
            .collect();
        let unknowns = places.iter().flatten().count() * WIDTH + 4;
        Self {
            offsets_m: vec![0.0; tracker.frames.len()],
            offset_m: 0.0,
            plane: Vector3::zeros(),
            has_floor: false,
            unexplained_m: UNEXPLAINED_M,
            uneven_m: 0.002,
            range_m: tracker.range_m,
            cube_m: tracker.cube_m(),
            threads: tracker.threads(),
            is_exact,
            places,
            unknowns,
            solved: None,
            is_settled: false,
        }
    }

    fn links(&self, frames: &[Option<Kept>], cube_m: f64, noise: &super::Noise) -> Vec<Link> {
        let moved = self.moved(frames);
        let chosen: Vec<(usize, &Kept)> = (0..frames.len())
            .filter(|&i| self.places[i].is_some())
            .filter_map(|i| moved[i].as_ref().map(|kept| (i, kept)))
            .collect();
        let along_m = if self.is_settled { SETTLED } else { ALONG } * cube_m;
        let mut found = links(&chosen, cube_m, along_m, noise, self.threads);
        // Back to where the pixels were: the offsets are unknowns.
        for sight in found.iter_mut().flat_map(|link| &mut link.sights) {
            sight.at -= sight.ray * self.offsets_m[sight.frame];
        }
        found
    }

    /// The frames with their offsets.
    fn moved(&self, frames: &[Option<Kept>]) -> Vec<Option<Kept>> {
        let moved = |(kept, &offset): (&Option<Kept>, &f64)| {
            let mut kept = kept.clone()?;
            kept.patches.iter_mut().for_each(|p| p.at += p.ray * offset);
            Some(kept)
        };
        frames.iter().zip(&self.offsets_m).map(moved).collect()
    }

    /// Turns everything so that the floor is z = 0.
    fn level(&mut self, frames: &mut [Option<Kept>]) {
        let sensors: Vec<Vector3<f64>> = frames.iter().flatten().map(|k| k.pose.shift).collect();
        let Some(first) = sensors.first() else { return };
        let mean = sensors.iter().sum::<Vector3<f64>>() / sensors.len() as f64;
        let moved = self.moved(frames);
        let points = moved.iter().flatten().flat_map(|kept| {
            kept.patches.iter().step_by(3).map(|p| (kept.pose.apply(&p.at) - first).into())
        });
        let points: Vec<crate::Point> = points.collect();
        let plane = floor(&points, (mean - first).into(), self.range_m, self.threads);
        let Some(plane) = plane else { return };
        self.has_floor = true;
        let up = Vector3::from(plane.normal);
        let offset_m = plane.offset_m + up.dot(first);
        let by = if self.is_exact { return } else { onto_z(&up) };
        let motion = Motion { rotation: by, shift: Vector3::new(0.0, 0.0, -offset_m) };
        frames.iter_mut().flatten().for_each(|kept| kept.pose = motion.after(&kept.pose));
        self.plane = Vector3::zeros();
    }

    fn step(&mut self, frames: &mut [Option<Kept>], found: &[Link]) {
        let middles = middles(frames);
        let mut system = NormalEquations::new(self.unknowns);
        for link in found {
            let rows = self.rows(frames, &middles, link);
            if rows.len() > 1 {
                system.add_surfel(&rows);
            }
        }
        self.expect(&mut system);
        let Some(solved) = system.solved() else { return };
        for (i, kept) in frames.iter_mut().enumerate() {
            let (Some(kept), Some(at)) = (kept.as_mut(), self.places[i]) else { continue };
            let by = Vector3::new(solved.x[at], solved.x[at + 1], solved.x[at + 2]);
            let shift = Vector3::new(solved.x[at + 3], solved.x[at + 4], solved.x[at + 5]);
            kept.pose = Motion::small(&by, &middles[i], &shift).after(&kept.pose);
            self.offsets_m[i] += solved.x[at + 6];
        }
        let last = self.unknowns - 4;
        self.offset_m += solved.x[last];
        self.plane += Vector3::new(solved.x[last + 1], solved.x[last + 2], solved.x[last + 3]);
        self.solved = Some(solved);
    }

    /// What is expected before anything was seen.
    fn expect(&self, system: &mut NormalEquations) {
        let common = self.unknowns - 4;
        let mut first = true;
        for (i, at) in self.places.iter().enumerate() {
            let Some(at) = *at else { continue };
            let held = if first || self.is_exact { HELD } else { 1.0 / (LAID * LAID) };
            first = false;
            (0..6).for_each(|k| system.add_prior(at + k, None, 0.0, held));
            let off = self.offsets_m[i] - self.offset_m;
            system.add_prior(at + 6, Some(common), off, 1.0 / (OWN_OFFSET_M * OWN_OFFSET_M));
        }
        system.add_prior(common, None, self.offset_m, 1.0 / (OFFSET_M * OFFSET_M));
        (1..4).for_each(|k| system.add_prior(common + k, None, self.plane[k - 1], 1.0));
    }

    /// What is known of the height of a surfel, along its normal.
    fn rows(&self, frames: &[Option<Kept>], middles: &[Vector3<f64>], link: &Link) -> Vec<Row> {
        let n = link.surfel.normal;
        let mut rows: Vec<Row> = Vec::with_capacity(link.sights.len() + 1);
        for sight in &link.sights {
            let (Some(kept), Some(first)) = (&frames[sight.frame], self.places[sight.frame]) else {
                continue;
            };
            let at = self.place(kept, sight);
            let turn = (at - middles[sight.frame]).cross(&n);
            let ray = n.dot(&(kept.pose.rotation * sight.ray));
            let row = [turn.x, turn.y, turn.z, n.x, n.y, n.z, ray];
            let weight = 1.0 / (sight.noise_m2 + self.unexplained_m * self.unexplained_m);
            let off = n.dot(&(at - link.surfel.at));
            rows.push(Row { first, len: WIDTH, row, off, weight });
        }
        lighten(&mut rows, self.is_settled);
        rows.extend(self.floor_row(link));
        rows
    }

    fn place(&self, kept: &Kept, sight: &Sight) -> Vector3<f64> {
        kept.pose.apply(&(sight.at + sight.ray * self.offsets_m[sight.frame]))
    }

    /// What the plane of the floor says of a surfel that is of it.
    fn floor_row(&self, link: &Link) -> Option<Row> {
        if !self.is_floor(link) {
            return None;
        }
        let at = link.surfel.at;
        let cells = (ALIKE * self.range_m / self.cube_m) * (ALIKE * self.range_m / self.cube_m);
        let weight = 1.0 / (self.uneven_m * self.uneven_m * cells);
        let mut row = [0.0; WIDTH];
        row[..3].copy_from_slice(&[1.0, at.x, at.y]);
        let off = self.plane.dot(&Vector3::new(1.0, at.x, at.y)) - at.z;
        Some(Row { first: self.unknowns - 3, len: 3, row, off, weight })
    }

    fn is_floor(&self, link: &Link) -> bool {
        let surfel = &link.surfel;
        let height_m = surfel.at.z - self.plane.dot(&Vector3::new(1.0, surfel.at.x, surfel.at.y));
        self.has_floor
            && !self.is_exact
            && height_m.abs() < FLOOR * self.range_m
            && surfel.normal.z > LEVEL
    }

    /// Takes the noise that the pixels' own does not explain, and the unevenness of the floor.
    fn learn(&mut self, frames: &[Option<Kept>], found: &[Link]) {
        let mut off = Vec::new();
        let mut noise_m2 = 0.0;
        for link in found.iter().filter(|link| link.sights.len() > 1) {
            for (sight, value) in link.sights.iter().zip(self.residuals(frames, link)) {
                // The mean was taken of the same values.
                let k = link.sights.len() as f64;
                off.push(value * (k / (k - 1.0)).sqrt());
                noise_m2 += sight.noise_m2;
            }
        }
        if off.is_empty() {
            return;
        }
        let noise_m2 = noise_m2 / off.len() as f64;
        let seen_m = scale(off);
        self.unexplained_m = (seen_m * seen_m - noise_m2).max(1e-8).sqrt();
        self.uneven_m = self.unevenness_m(frames, found);
    }

    /// Root mean square of the floor's departure from its plane, over places that are alike.
    fn unevenness_m(&self, frames: &[Option<Kept>], found: &[Link]) -> f64 {
        let mut sums: std::collections::BTreeMap<[i32; 2], (f64, f64)> = Default::default();
        let wide_m = ALIKE * self.range_m;
        for link in found.iter().filter(|link| self.is_floor(link)) {
            let at = link.surfel.at;
            let above = self.mean_off(frames, link) * link.surfel.normal.z + at.z
                - self.plane.dot(&Vector3::new(1.0, at.x, at.y));
            let sum = sums.entry([at.x, at.y].map(|v| (v / wide_m).floor() as i32)).or_default();
            *sum = (sum.0 + above, sum.1 + 1.0);
        }
        let means: Vec<f64> =
            sums.values().filter(|sum| sum.1 > 10.0).map(|sum| sum.0 / sum.1).collect();
        scale(means).max(EVEN_M)
    }

    fn mean_off(&self, frames: &[Option<Kept>], link: &Link) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for sight in &link.sights {
            if let Some(kept) = &frames[sight.frame] {
                let w = 1.0 / (sight.noise_m2 + self.unexplained_m * self.unexplained_m);
                sum += w * link.surfel.normal.dot(&(self.place(kept, sight) - link.surfel.at));
                weight += w;
            }
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// How far each frame that saw a surfel is from what all of them agree on.
    fn residuals(&self, frames: &[Option<Kept>], link: &Link) -> Vec<f64> {
        let mean = self.mean_off(frames, link);
        let off = |sight: &Sight| {
            let kept = frames[sight.frame].as_ref()?;
            Some(link.surfel.normal.dot(&(self.place(kept, sight) - link.surfel.at)) - mean)
        };
        link.sights.iter().map(|sight| off(sight).unwrap_or(0.0)).collect()
    }

    fn joint(mut self, frames: &[Option<Kept>], found: &[Link]) -> Joint {
        let spread = self.spread(frames, found);
        let (u_model_m, u_offset_m) = self.by_covariance(frames, found, spread.excess);
        for (i, kept) in frames.iter().enumerate() {
            if kept.is_none() || self.places[i].is_none() {
                self.offsets_m[i] = self.offset_m;
            }
        }
        Joint {
            poses: frames.iter().map(|kept| kept.as_ref().map(|kept| kept.pose)).collect(),
            offsets_m: self.offsets_m,
            offset_m: self.offset_m,
            u_offset_m,
            between_m: spread.between_m,
            u_height_m: (spread.of_mean_m * spread.of_mean_m + u_model_m * u_model_m).sqrt(),
            uneven_m: self.uneven_m,
            loops: loops(found),
            has_floor: self.has_floor,
        }
    }

    /// How frames differ over places that are a few cubes wide.
    fn spread(&self, frames: &[Option<Kept>], found: &[Link]) -> Spread {
        let wide_m = ALIKE * self.range_m;
        let mut sums: std::collections::BTreeMap<([i32; 3], usize), [f64; 3]> = Default::default();
        for link in found.iter().filter(|link| link.sights.len() > 1) {
            let place = link.surfel.at.map(|v| (v / wide_m).floor() as i32).into();
            for (sight, off) in link.sights.iter().zip(self.residuals(frames, link)) {
                let sum = sums.entry((place, sight.frame)).or_default();
                let variance = sight.noise_m2 + self.unexplained_m * self.unexplained_m;
                *sum = [sum[0] + off, sum[1] + 1.0, sum[2] + variance];
            }
        }
        let mut places: std::collections::BTreeMap<[i32; 3], Vec<[f64; 3]>> = Default::default();
        for ((place, _), sum) in sums.into_iter().filter(|(_, sum)| sum[1] >= 8.0) {
            places.entry(place).or_default().push(sum);
        }
        Spread::of(places.into_values().filter(|own| own.len() > 1))
    }

    /// Uncertainties of heights above the floor, and of the common offset.
    fn by_covariance(&self, frames: &[Option<Kept>], found: &[Link], excess: f64) -> (f64, f64) {
        let Some(solved) = &self.solved else { return (0.0, OFFSET_M) };
        let middles = middles(frames);
        let seen: Vec<&Link> = found.iter().filter(|link| !link.sights.is_empty()).collect();
        let every = seen.len().div_ceil(ASKED).max(1);
        let mut variances = Vec::new();
        for link in seen.iter().step_by(every) {
            let rows = self.rows(frames, &middles, link);
            let weight: f64 = rows.iter().map(|r| r.weight).sum();
            let mut combination = DVector::zeros(solved.unknowns());
            for r in &rows {
                (0..r.len).for_each(|k| combination[r.first + k] += r.weight / weight * r.row[k]);
            }
            let at = link.surfel.at;
            let floor = [1.0, at.x, at.y].map(|v| v * link.surfel.normal.z);
            (0..3).for_each(|k| combination[self.unknowns - 3 + k] -= floor[k]);
            variances.push(solved.variance(&combination));
        }
        let mean = variances.iter().sum::<f64>() / variances.len().max(1) as f64;
        let mut common = DVector::zeros(solved.unknowns());
        common[self.unknowns - 4] = 1.0;
        let u_offset_m = (solved.variance(&common) * excess).sqrt();
        ((mean * excess).sqrt(), if u_offset_m < OFFSET_M { u_offset_m } else { OFFSET_M })
    }
}

struct Spread {
    between_m: f64,
    of_mean_m: f64,
    /// Variance of places over that of surfels whose errors have nothing in common.
    excess: f64,
}

impl Spread {
    /// Of the sums of each frame, place by place.
    fn of(places: impl Iterator<Item = Vec<[f64; 3]>>) -> Self {
        let (mut squares, mut expected, mut free) = (0.0, 0.0, 0.0);
        let (mut of_mean, mut count) = (0.0, 0.0);
        for own in places {
            let frames = own.len() as f64;
            let means: Vec<f64> = own.iter().map(|sum| sum[0] / sum[1]).collect();
            let middle = means.iter().sum::<f64>() / frames;
            let square: f64 = means.iter().map(|m| (m - middle) * (m - middle)).sum();
            squares += square;
            free += frames - 1.0;
            of_mean += square / (frames - 1.0) / frames;
            count += 1.0;
            expected += own.iter().map(|sum| sum[2] / (sum[1] * sum[1])).sum::<f64>() / frames
                * (frames - 1.0);
        }
        if count == 0.0 {
            return Self { between_m: 0.0, of_mean_m: 0.0, excess: 1.0 };
        }
        let excess = squares / expected;
        Self {
            between_m: (squares / free).sqrt(),
            of_mean_m: (of_mean / count).sqrt(),
            excess: if excess > 1.0 { excess } else { 1.0 },
        }
    }
}

/// Takes weight from rows that are far from what the others say, in their standard deviations.
fn lighten(rows: &mut [Row], is_settled: bool) {
    let middle = crate::robust::median(rows.iter().map(|r| r.off).collect());
    let off = |row: &Row| (row.off - middle).abs() * row.weight.sqrt();
    // Of two that disagree, none is known to be right.
    let is_pair = rows.len() == 2;
    let apart = rows.iter().map(off).fold(0.0, f64::max);
    for row in &mut *rows {
        let deviations = if is_pair { apart } else { off(row) };
        if deviations > HUBER {
            let by = HUBER / deviations;
            row.weight *= if is_settled { by * by * by } else { by };
        }
    }
}

/// The middle of what each frame saw: its pose is turned about it.
fn middles(frames: &[Option<Kept>]) -> Vec<Vector3<f64>> {
    let middle = |kept: &Kept| {
        let sum: Vector3<f64> = kept.patches.iter().map(|p| p.at).sum();
        kept.pose.apply(&(sum / kept.patches.len().max(1) as f64))
    };
    frames.iter().map(|kept| kept.as_ref().map_or_else(Vector3::zeros, middle)).collect()
}

/// Pairs of frames that share surfels, neighbours aside.
fn loops(found: &[Link]) -> usize {
    let mut shared: std::collections::BTreeMap<(usize, usize), usize> = Default::default();
    for link in found {
        for (i, one) in link.sights.iter().enumerate() {
            for other in &link.sights[..i] {
                *shared.entry((other.frame, one.frame)).or_default() += 1;
            }
        }
    }
    shared.iter().filter(|((a, b), count)| b - a > 1 && **count >= SHARED).count()
}

/// The smallest rotation that takes a direction to z.
fn onto_z(up: &Vector3<f64>) -> Matrix3<f64> {
    let axis = up.cross(&Vector3::z());
    let sine = axis.norm();
    if sine < 1e-15 {
        return Matrix3::identity();
    }
    super::motion::turn(&(axis / sine * libm::atan2(sine, up.z)))
}
