"""Prints the golden values of ../statistics.rs.

python 3.11 with scipy 1.17.1, pingouin 0.7.0, statsmodels 0.15.0, numpy 2.4.6
"""
import numpy as np, pandas as pd, pingouin as pg, scipy.stats as ss
from statsmodels.stats.multitest import multipletests
from statsmodels.tsa.stattools import acf

A = [66.1, 71.4, 58.9, 80.2, 75.5, 62.3, 69.8, 73.1, 64.4, 77.7, 60.6, 70.9]
B = [68.0, 72.9, 59.3, 83.8, 75.1, 65.2, 72.6, 77.8, 66.4, 80.3, 60.5, 76.4]
C = [70.3, 74.0, 63.1, 84.4, 79.2, 64.7, 74.9, 78.2, 70.1, 85.0, 63.6, 77.0]
D = [72.8, 77.3, 62.2, 89.9, 81.0, 70.6, 75.3, 83.7, 71.9, 84.1, 69.9, 79.5]
TIED = [1.5, -1.5, 0.0, 2.0, 3.0, 3.0, -0.5, 2.0, 4.0, 0.0, 1.0, 5.0]
LONG = [round(np.sin(1.7 * k) * 3 + 0.9 + 0.01 * k, 3) for k in range(60)]
SLOW = [68.0, 70.9, 69.1, 71.2, 72.8, 70.5, 71.6, 68.9, 69.7, 66.9, 68.2, 66.6]
P = [0.01, 0.04, 0.03, 0.005, 0.6, 0.03]


def show(name, *values):
    print(name, " ".join(repr(float(v)) for v in values))


for alternative in ("two-sided", "less", "greater"):
    t = ss.ttest_rel(B, A, alternative=alternative)
    show("t " + alternative, t.statistic, t.pvalue)
    for method, correction in (("auto", False), ("asymptotic", False), ("asymptotic", True)):
        for data, values in (("plain", np.subtract(B, A)), ("tied", TIED), ("long", LONG)):
            for zeros in ("wilcox", "pratt"):
                w = ss.wilcoxon(values, zero_method=zeros, correction=correction, method=method, alternative=alternative)
                show(f"wilcoxon {alternative} {method} {correction} {data} {zeros}", w.statistic, w.pvalue)
show("interval", *ss.ttest_rel(B, A).confidence_interval(0.95), *ss.ttest_rel(B, A).confidence_interval(0.9))
d = np.subtract(B, A)
dz = d.mean() / d.std(ddof=1)
show("dz gz dav", dz, dz * (1 - 3 / (4 * 11 - 1)), pg.compute_effsize(B, A, paired=True, eftype="cohen"))
show("rbc", pg.wilcoxon(B, A)["RBC"].iloc[0])
for name, values in (("A", A), ("LONG", LONG), ("three", A[:3]), ("five", A[:5]), ("skewed", np.exp(np.array(A) / 5))):
    show("shapiro " + name, *ss.shapiro(values))
show("friedman", *ss.friedmanchisquare(A, B, C, D))
frame = pd.DataFrame({"A": A, "B": B, "C": C, "D": D})
show("kendall", pg.friedman(frame)["W"].iloc[0])
show("friedman tied", *ss.friedmanchisquare(np.round(A, -1), np.round(B, -1), np.round(C, -1)))
for effsize in ("np2", "ng2"):
    r = pg.rm_anova(frame, correction=True, detailed=True, effsize=effsize).iloc[0]
    show("rm " + effsize, r["F"], r["DF"], r["p_unc"], r["eps"], r["p_GG_corr"], r[effsize], r["W_spher"], r["p_spher"])
for method in ("auto", "exact", "asymptotic"):
    p = ss.page_trend_test(np.array([A, B, C, D]).T, method=method)
    show("page " + method, p.statistic, p.pvalue)
tied = np.round(np.array([A, C, B]).T, -1)
for method in ("exact", "asymptotic"):
    p = ss.page_trend_test(tied, method=method)
    show("page tied " + method, p.statistic, p.pvalue)
for method in ("holm", "bonferroni", "fdr_bh"):
    show(method, *multipletests(P, method=method)[1])
for name, test in (("pearson", ss.pearsonr), ("spearman", ss.spearmanr)):
    show(name, *test(A, B), *test(A, TIED), *test(LONG[:20], LONG[40:]))
show("pearson interval", *ss.pearsonr(A, TIED).confidence_interval(0.95))
long = frame.assign(s=range(12)).melt(id_vars="s", var_name="c", value_name="v")
for parametric in (True, False):
    r = pg.pairwise_tests(data=long, dv="v", within="c", subject="s", parametric=parametric, padjust="holm")
    show(f"pairwise parametric {parametric}", *r["p_corr"])

c, a = np.array(C[:9]), np.array(A)
show("change", c.mean() - a.mean(), c.std(ddof=1) - a.std(ddof=1), np.median(c) - np.median(a),
     100 * (c.mean() - a.mean()) / abs(a.mean()), (c.mean() - a.mean()) / a.std(ddof=1),
     (np.median(c) - np.median(a)) / ss.median_abs_deviation(a, scale="normal"))
count = lambda x: max(2, len(x) * (1 - max(0, acf(x, nlags=1)[1])) / (1 + max(0, acf(x, nlags=1)[1])))
show("count", count(SLOW), count(A), acf(SLOW, nlags=1)[1], acf(A, nlags=1)[1])
n, m = count(c), count(SLOW)
cohen = pg.compute_effsize(c, SLOW, eftype="cohen")
g = cohen * (1 - 3 / (4 * (n + m - 2) - 1))
e = np.sqrt(1 / n + 1 / m + g**2 / (2 * (n + m)))
show("standardised", cohen, g, e, g - ss.norm.ppf(0.975) * e, g + ss.norm.ppf(0.975) * e)


class SplitMix64:
    def __init__(self, seed):
        self.state = seed

    def below(self, count):
        m = (1 << 64) - 1
        self.state = (self.state + 0x9E3779B97F4A7C15) & m
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & m
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & m
        return ((z ^ (z >> 31)) * count) >> 64


for name, statistic in (("mean", np.mean), ("median", np.median), ("sd", lambda x, axis: np.std(x, ddof=1, axis=axis))):
    random = SplitMix64(7)
    drawn = np.array([statistic(d[[random.below(12) for _ in range(12)]], axis=0) for _ in range(2000)])
    given = ss._resampling.BootstrapResult(None, drawn, None)
    for method in ("percentile", "BCa"):
        b = ss.bootstrap((d,), statistic, n_resamples=0, bootstrap_result=given, method=method, confidence_level=0.95)
        show(f"bootstrap {name} {method}", *b.confidence_interval, b.standard_error)
