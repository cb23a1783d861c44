//! Criterion benches, one a kernel, with as many threads as the machine has.

use criterion::{BenchmarkId, Criterion, Throughput};
use divespot_benches::{JOBS, Scan};
use divespot_core::Result;

const COUNTS: [u32; 2] = [30_000, 300_000];

fn main() -> Result<()> {
    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    let scans: Vec<(u32, Scan)> =
        COUNTS.iter().map(|&n| Ok((n, Scan::new(n)?))).collect::<Result<_>>()?;
    for job in JOBS {
        let mut group = criterion.benchmark_group(job.name);
        for (count, scan) in &scans {
            // A kernel that fails would look fast.
            (job.run)(scan, 0)?;
            group.throughput(Throughput::Elements(u64::from(*count)));
            group.bench_with_input(BenchmarkId::from_parameter(count), scan, |bencher, scan| {
                bencher.iter(|| (job.run)(scan, 0));
            });
        }
        group.finish();
    }
    criterion.final_summary();
    Ok(())
}
