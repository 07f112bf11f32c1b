//! Group statistics compared with SciPy and pingouin: 30 participants, four conditions.

use std::error::Error;
use std::path::Path;

use serde_json::Value;
use teampulse_signal::statistics::{
    Alternative, Correction, PageMethod, Wilcoxon, WilcoxonMethod, cohen_d_average, cohen_dz,
    friedman, hedges_gz, mean_interval, page_trend, paired_t, pairwise_t, repeated_measures,
};

use crate::golden::{Worst, golden, number, numbers};

/// Prints the figures with their bars; returns whether all bars were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let values = golden(data, "stats_paired.json")?;
    let column = |name: &str| numbers(&values["input"][name]);
    let columns = ["baseline", "1back", "2back", "3back"].map(column);
    let [baseline, one, two, three] = [0, 1, 2, 3].map(|index| columns[index].as_slice());
    let mut statistics = Worst::default();
    let mut p_values = Worst::default();
    for (name, task) in [("1back", one), ("2back", two), ("3back", three)] {
        let golden = &values[name];
        let test = paired_t(task, baseline, Alternative::TwoSided)?;
        let differences: Vec<f64> = task.iter().zip(baseline).map(|(a, b)| a - b).collect();
        let interval = mean_interval(&differences, 0.95)?;
        let normal = Wilcoxon { method: WilcoxonMethod::Normal, ..Wilcoxon::default() };
        let ranks = normal.paired(task, baseline)?;
        statistics.see("t", test.t, number(golden, "t")?);
        statistics.see("mean", test.mean_difference, number(golden, "mean")?);
        statistics.see("low end", interval.low, numbers(&golden["ci"])[0]);
        statistics.see("high end", interval.high, numbers(&golden["ci"])[1]);
        statistics.see("dz", cohen_dz(task, baseline)?, number(golden, "dz")?);
        statistics.see("gz", hedges_gz(task, baseline)?, number(golden, "gz")?);
        statistics.see("dav", cohen_d_average(task, baseline)?, number(golden, "dav")?);
        statistics.see("W", ranks.w_plus.min(ranks.w_minus), number(golden, "wilcoxon_W")?);
        p_values.see("t", test.p, number(golden, "p")?);
        p_values.see("Wilcoxon", ranks.p, number(golden, "wilcoxon_p")?);
    }
    let order = friedman(&[baseline, one, two, three])?;
    statistics.see("chi2", order.chi2, number(&values["friedman"], "chi2")?);
    statistics.see("Kendall's W", order.kendall_w, number(&values["friedman"], "kendallW")?);
    p_values.see("Friedman", order.p, number(&values["friedman"], "p")?);
    let trend = page_trend(&[three, two, one], PageMethod::Normal)?;
    statistics.see("L", trend.l, number(&values["trend_page"], "L")?);
    p_values.see("Page", trend.p, number(&values["trend_page"], "p")?);
    let mut rounded = Worst::default();
    see_variance(&mut rounded, &values["rm_anova"][0], &[baseline, one, two, three])?;
    see_pairs(&mut rounded, &values["pairwise_holm"], &[one, two, three, baseline])?;
    let met = [
        statistics.print("statistics of SciPy", 1e-9),
        p_values.print("p-values of SciPy", 1e-9),
        // These golden values are stored with ten decimals.
        rounded.print("analysis of variance and pairs of pingouin, rounded", 1e-6),
    ];
    Ok(met.iter().all(|&each| each))
}

fn see_variance(
    worst: &mut Worst,
    golden: &Value,
    conditions: &[&[f64]],
) -> Result<(), Box<dyn Error>> {
    let variance = repeated_measures(conditions)?;
    worst.see("F", variance.f, number(golden, "F")?);
    worst.see("p", variance.p, number(golden, "p_unc")?);
    worst.see("ε", variance.greenhouse_geisser, number(golden, "eps")?);
    worst.see("corrected p", variance.p_greenhouse_geisser, number(golden, "p_GG_corr")?);
    worst.see("η²", variance.generalised_eta_squared, number(golden, "ng2")?);
    let sphericity = variance.sphericity.ok_or("test sphericity")?;
    worst.see("Mauchly's W", sphericity.w, number(golden, "W_spher")?);
    worst.see("Mauchly's p", sphericity.p, number(golden, "p_spher")?);
    Ok(())
}

fn see_pairs(
    worst: &mut Worst,
    golden: &Value,
    conditions: &[&[f64]],
) -> Result<(), Box<dyn Error>> {
    let pairs = pairwise_t(conditions, Correction::Holm)?;
    for (pair, golden) in pairs.iter().zip(golden.as_array().into_iter().flatten()) {
        worst.see("T", pair.test.t, number(golden, "T")?);
        let p = number(golden, "p_corr")?;
        // The smallest golden values are stored as 0 or with three digits.
        if p > 1e-4 {
            worst.see("Holm's p", pair.p_corrected, p);
        }
    }
    Ok(())
}
