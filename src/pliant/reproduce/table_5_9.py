"""Table 5.9: disease and per cent of stenosis by territory."""

from __future__ import annotations

from ..heart import heart_study
from ._hearts import hearts
from .bench import Bench
from .findings import Experiment, Findings, Row

PRINTED = {"LAD": (0.88, 0.85), "LCX": (0.91, 0.90), "RCA": (0.92, 0.89)}


def _run(bench: Bench) -> Findings:
    features, stenosis, said = hearts(bench)
    study = heart_study(
        features, stenosis, scenario="territory", classifiers=("logistic",), regressors=("linear", "ridge"),
        permutations=20 if bench.quick else 100, repeats=1 if bench.quick else 3, rng=bench.seed,
    )  # fmt: skip
    bag = "bag of features"
    rows = []
    for name in study.problems:
        accuracy, r = PRINTED[name]
        for method, model, printed, what in (
            (bag, "logistic", accuracy, "accuracy"),
            ("roughness", "logistic", None, "accuracy"),
            (bag, "linear", r, "r by least squares"),
            (bag, "ridge", None, "r by ridge regression"),
            ("roughness", "linear", None, "r"),
        ):
            score = study.row(name, method, model).score
            rows.append(Row(f"{name}, {method}: {what}", printed, score.value, score.low, score.high))
    means = {
        "bag": study.mean_score(bag, "logistic"),
        "rough": study.mean_score("roughness", "logistic"),
        "r": study.mean_score(bag, "ridge"),
        "rough r": study.mean_score("roughness", "linear"),
    }
    gap, low, high = study.above(
        bag, "roughness", model="logistic", baseline_model="logistic", rng=bench.seed
    )
    rows.append(Row("bag of features above mean curvedness: accuracy", None, gap, low, high))
    works = means["bag"] >= 0.7 and means["r"] >= 0.5
    return Findings(
        "holds" if works and means["bag"] > means["rough"] else "holds partly" if works else "does not hold",
        f"The bag of features has a mean balanced accuracy of {means['bag']:.2f} and r of {means['r']:.2f}; "
        f"mean curvedness alone {means['rough']:.2f} and {means['rough r']:.2f}, so the bag is "
        f"{gap:+.2f} ({low:+.2f} to {high:+.2f}) in accuracy above one number. Least squares on 20 "
        "histogram values of a few dozen subjects has a sizeable r on nothing: read its row beside the "
        "ridge's.",
        said,
        tuple(rows),
        {"folds": 10},
    )


EXPERIMENT = Experiment(
    "table-5.9",
    "Territories: disease and per cent of stenosis",
    "Accuracies of .88 to .92 and correlations of .85 to .90 by territory.",
    "Mean accuracy .7 and r .5 or more and above mean curvedness; in part without the last.",
    _run,
)
