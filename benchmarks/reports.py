"""Markdown of the blocks, and pictures, each a function of the lines of one table."""

import numpy as np
import pandas as pd

from benchmarks import another_bearing as bearing
from benchmarks.blocks import markdown
from benchmarks.cross_speed import OURS, SIMULATED
from benchmarks.figures.style import BLUE, GREY, ORANGE, saved_figure
from benchmarks.peers import BATCH
from benchmarks.published import PRINTED
from benchmarks.rigs import SIX_RIGS
from benchmarks.tallies import by_rig, shares
from benchmarks.tallies import calibration as calibrated

#: Rows of a table in a page.
_MOST_ROWS = 8
_ONE = "one speed"


def _chosen(lines, **columns):
    for column, value in columns.items():
        lines = lines[lines[column].astype(str) == value]
    return lines


def _shown(table, always, most=_MOST_ROWS):
    """Keep the rows of some methods, and the best of the others."""
    is_kept = table["method"].isin(always)
    others = table.index[~is_kept][: most - is_kept.sum()]
    return table[is_kept | table.index.isin(others)]


def _of_length(lines, length, trained=_ONE):
    return by_rig(_chosen(lines, length=length, **{"trained at": trained}), SIX_RIGS)


def cross_speed_overview(lines):
    """Tabulate windows of both lengths and rows of a second, ours and the best peers."""
    columns = {"mean": "mean", "worst rig": "worst rig", "worst pair": "worst pair"}
    parts = [
        _of_length(lines, length)
        .set_index("method")[list(columns)]
        .add_prefix(f"{length}: ")
        for length in ("1200", "4800")
    ]
    second = _of_length(lines, "1 s").set_index("method")["mean"].rename("1 s: mean")
    table = pd.concat([*parts, second], axis=1).sort_values(
        "1200: mean", ascending=False
    )
    table = table.rename_axis("method").reset_index()
    table = _shown(table, [*OURS[:2], *BATCH, "MiniRocket"])
    return (
        "Share of right verdicts at speeds that were not used for training, for rows of 1200 "
        "and 4800 samples and of a second: mean over the six rigs, worst rig, and worst pair "
        "of speeds of any rig. Training and test share the bearing and its mounting. Methods "
        "with “batch” follow another protocol: they see all unlabelled test rows of a speed "
        f"at once, and need every condition equally often.\n\n{markdown(table)}"
    )


def cross_speed(lines):
    """Tabulate each length of windows, and name the rigs on which a peer is ahead."""
    parts = [
        "Fitted on the first halves of the recordings of one speed, scored on the second "
        "halves at every other speed. The interval holds 90 % of 1000 bootstrap draws of rigs."
    ]
    for length in ("1200", "4800"):
        table = _of_length(lines, length)
        parts.append(f"**Rows of {length} samples**")
        parts.append(markdown(_shown(table, [*OURS, *BATCH])))
        parts.append(_ahead(table))
    return "\n\n".join(parts)


def _ahead(table):
    table = table.set_index("method")
    if "make_diagnoser" not in table.index:
        return ""
    peers = table.drop(index=[name for name in (*OURS, *BATCH) if name in table.index])
    sentences = []
    for rig in (rig for rig in SIX_RIGS if rig in table):
        best = peers[rig].idxmax()
        mine = table.loc["make_diagnoser", rig]
        if peers[rig][best] > mine:
            sentences.append(
                f"{rig} ({best}, {peers[rig][best]:.3f} against {mine:.3f})"
            )
    where = "; ".join(sentences) or "none"
    return f"Rigs on which a peer has a higher mean than `make_diagnoser`: {where}."


def several_speeds(lines):
    """Tabulate verdicts after training at all speeds but one."""
    parts = [
        _of_length(lines, length, "others")
        .set_index("method")[["mean", "worst rig", "worst pair"]]
        .add_prefix(f"{length}: ")
        for length in ("1200", "1 s")
    ]
    table = pd.concat(parts, axis=1).sort_values("1200: mean", ascending=False)
    table = _shown(table.rename_axis("method").reset_index(), OURS[:2])
    return (
        "Trained at all speeds but one, tested at that one, in rows of 1200 samples and of a "
        f"second. Mean over the six rigs.\n\n{markdown(table)}"
    )


def calibration(lines):
    """Tabulate stated probabilities by length of rows, number of speeds, and rig."""
    ours = _chosen(lines, method="make_diagnoser")
    ours = ours[ours["rig"].isin(SIX_RIGS)]
    table = calibrated(ours, ["trained at", "length"])
    of_rigs = calibrated(ours, ["trained at", "length", "rig"])
    of_rigs["text"] = [
        f"{stated:.2f} / {right:.2f}"
        for stated, right in of_rigs[["stated on average", "right"]].to_numpy()
    ]
    rig_table = of_rigs.pivot(
        index=["trained at", "length"], columns="rig", values="text"
    )
    rig_table = rig_table.reset_index()
    return (
        "Probabilities of `make_diagnoser` at other speeds, on the bearing of the training. "
        f"All rows of the six rigs.\n\n{markdown(table)}\n\n"
        f"Stated on average / right, by rig:\n\n{markdown(rig_table)}"
    )


def simulated(lines):
    """Tabulate the rigs with a torque."""
    kept = _chosen(lines, **{"trained at": _ONE})
    kept = kept[kept["rig"].isin(SIMULATED)]
    table = shares(kept, ["method", "rig", "length"]).unstack(["rig", "length"])
    table.columns = [f"{rig}, {length}" for rig, length in table.columns]
    table = table.sort_values(table.columns[0], ascending=False).reset_index()
    return (
        "Results of a simulation, trained at one speed. Our diagnosers receive the torque; of "
        f"the peers only the one whose name states it.\n\n{markdown(table)}"
    )


def stretches(lines):
    """Tabulate rows of a second, with wrong speeds."""
    table = _of_length(lines, "1 s")
    wrong = [name for name in table["method"] if name.startswith("make_diagnoser")]
    return (
        "Rows of a second, trained at one speed. The speeds in `predict` are nominal unless the "
        f"name of a row states an error.\n\n{markdown(_shown(table, wrong))}"
    )


def _at_bearing(lines, protocol, methods=bearing.METHODS):
    """Return a table of methods and rigs for one protocol of other bearings."""
    lines = _chosen(lines, protocol=protocol)
    lines = lines[lines["method"].isin(methods)]
    of_fold = lines.groupby(["method", "rig", "fold", "trained at"], sort=False)
    lines = of_fold[["rows", "right"]].sum().reset_index()
    table = by_rig(lines, bearing.SPECIMEN_RIGS)
    return table.rename(columns={"worst pair": "worst fold"})


def bearing_overview(lines):
    """Tabulate another bearing at another speed, ours and the best peers."""
    table = _at_bearing(lines, bearing.ANOTHER_SPEED).drop(columns="worst fold")
    knows = table["method"].isin(bearing.WITH_BEARING).map({True: "yes", False: "no"})
    table.insert(1, "knows the bearing", knows)
    stated = _chosen(lines, protocol=bearing.ANOTHER_SPEED)
    stated = calibrated(stated, ["method"]).set_index("method")
    for column in ("stated >= .9", "of these right"):
        table[column] = stated.loc[table["method"], column].to_numpy()
        # Votes are no probabilities.
        table.loc[table["method"] == "largest order contrast", column] = np.nan
    return (
        "Share of right fault locations on another bearing, at another speed, in rows of a "
        "second. Training and test share no bearing, no mounting and no recording. The interval "
        "holds 90 % of 1000 bootstrap draws of rigs. Right columns: share of rows stated with "
        f"a probability of at least .9, and the share of these that is right.\n\n{markdown(table)}"
    )


def another_bearing(lines):
    """Tabulate another bearing at another speed by rig, and the means of all protocols."""
    protocols = (
        bearing.ANOTHER_SPEED,
        bearing.ANOTHER,
        bearing.ANOTHER_LOAD,
        bearing.SAME,
    )
    columns = {}
    for protocol in protocols:
        table = _at_bearing(lines, protocol).set_index("method")
        means = zip(table["mean"], table["worst rig"], strict=True)
        texts = [f"{mean:.3f} ({worst:.3f})" for mean, worst in means]
        columns[protocol] = pd.Series(texts, table.index)
    every = pd.DataFrame(columns).loc[columns[bearing.ANOTHER_SPEED].index]
    return (
        f"**{bearing.ANOTHER_SPEED.capitalize()}**\n\n"
        f"{markdown(_at_bearing(lines, bearing.ANOTHER_SPEED))}\n\n"
        "**Mean of the rigs (worst rig) of each protocol.** Only Paderborn has another load at "
        f"one speed.\n\n{markdown(every.fillna('').reset_index())}"
    )


def bearing_locations(lines):
    """Count right verdicts by location, healthy rows included."""
    lines = _chosen(lines, protocol=bearing.ANOTHER_SPEED)
    lines = lines[lines["method"].isin(bearing.OURS[:2])]
    total = lines.groupby(["method", "rig", "location"], sort=False)[
        ["rows", "right"]
    ].sum()
    text = total["right"].astype(str) + " of " + total["rows"].astype(str)
    table = text.unstack("location").fillna("").reset_index()
    return (
        "Right rows of all rows on another bearing at another speed, by location. Healthy rows "
        f"that are not right are called faulty.\n\n{markdown(table)}"
    )


def bearing_probabilities(lines):
    """Tabulate the probabilities of make_diagnoser on other bearings."""
    lines = lines[lines["method"].isin(bearing.OURS[:2])]
    table = calibrated(lines, ["method", "protocol"])
    return markdown(table)


def bearing_variants(lines):
    """Tabulate fewer bearings in the training."""
    names = [bearing.OURS[0], *bearing.VARIANTS]
    table = _at_bearing(lines, bearing.ANOTHER_SPEED, names)
    return (
        "Right fault locations on another bearing at another speed. Without a note, the "
        f"training has all bearings but the tested one.\n\n{markdown(table)}"
    )


def recorded_prior(lines):
    """Tabulate what each prior of a recorded bearing states on it, and elsewhere."""
    kinds = {"same": bearing.SAME, "another": "another", "noise": "white"}
    shown = ["stated on average", "right", "stated >= .9", "of these right"]
    parts = []
    for kind, beginning in kinds.items():
        chosen = lines[lines["protocol"].str.startswith(beginning)]
        table = calibrated(chosen, ["length", "prior"]).set_index(["length", "prior"])
        # No name of noise is right.
        columns = shown[2:3] if kind == "noise" else shown[2 * (kind == "another") :]
        parts.append(table[columns].add_prefix(f"{kind}: "))
    return (
        "Probabilities of `make_diagnoser` without a bearing, by `recorded_prior`: all rows of the "
        "same bearing at other speeds, of another bearing, and of noise.\n\n"
        f"{markdown(pd.concat(parts, axis=1).reset_index())}"
    )


def orders_named(lines):
    """Count whole recordings and rows of a second that our classifier names, by rig."""
    ours = _chosen(lines, method="make_fault_order_classifier")
    parts = []
    for length, title in (("whole", "Whole recordings"), ("1 s", "Rows of a second")):
        rows = []
        for rig, group in _chosen(ours, length=length).groupby("rig", sort=False):
            line = {"rig": rig}
            for place in ("inner", "outer", "ball", "healthy"):
                here = group[group["location"] == place]
                right = (here["named"] == place).sum()
                line[place] = f"{right} of {len(here)}" if len(here) else ""
            names = ("inner", "outer", "ball")
            wrong = group["named"].isin(names) & (group["named"] != group["location"])
            faulty = group["location"] != "healthy"
            line["faults, other name"] = int((wrong & faulty).sum())
            line["healthy, named faulty"] = int((wrong & ~faulty).sum())
            rows.append(line)
        parts += [f"**{title}**", markdown(pd.DataFrame(rows))]
    return (
        "Right names of all recordings, by location, with the limits of `make_fault_order_"
        'classifier`. No fault was recorded. A fault without a name has the verdict "no fault '
        'pattern found" or "not identifiable", and so has a healthy recording.\n\n'
        + "\n\n".join(parts)
    )


def orders_methods(lines):
    """Tabulate how often the right location ranks first, by method."""
    lines = _chosen(lines, length="5 s")
    lines = lines[(lines["location"] != "healthy") & (lines["row"] == 0)]
    lines = lines.assign(
        rows=1, right=(lines["first"] == lines["location"]).astype(int)
    )
    races = lines[lines["location"] != "ball"]
    table = shares(lines, ["method", "rig"]).unstack("rig", sort=False)
    table.insert(0, "mean", table.mean(axis=1))
    of_races = shares(races, ["method", "rig"]).unstack("rig", sort=False).mean(axis=1)
    table.insert(1, "races", of_races)
    table.insert(2, "worst rig", table.iloc[:, 2:].min(axis=1))
    table = table.sort_values("mean", ascending=False).reset_index()
    return (
        "Share of faulty recordings whose location ranks first, without a limit: first 5 s, "
        f"nominal speed.\n\n{markdown(table)}"
    )


def detection_overview(lines):
    """Tabulate detectors at speeds without healthy recordings."""
    chosen = _chosen(lines, calibrated="left out", length="1 s")
    rows = []
    for method, group in chosen.groupby("method", sort=False):
        rigs = len(group["rig"].unique())
        rows.append({"detector": method, "rigs": rigs} | _rates(group))
    return (
        "Fitted on healthy recordings of all speeds but one, tested at that one, in rows of a "
        "second. Training and test share the healthy bearing, its mounting and its load: the "
        "limits hold for this bearing, mounting and load, at the speeds of the healthy "
        "recordings and near them.\n\n" + markdown(pd.DataFrame(rows))
    )


def detection(lines):
    """Tabulate false alarms and missed faults by protocol, and by rig."""
    at_left_out = _chosen(lines, calibrated="left out")
    parts = []
    for kind, title in (
        ("left out", "Healthy rows of all other speeds"),
        ("one speed", "Healthy rows of one speed, tested at every other"),
    ):
        rows = []
        chosen = _chosen(lines, calibrated=kind, length="1 s")
        for method, group in chosen.groupby("method", sort=False):
            rows.append({"detector": method} | _rates(group))
        parts += [
            f"**{title}, rows of a second, all rigs**",
            markdown(pd.DataFrame(rows)),
        ]
    rows = []
    ours = _chosen(at_left_out, method="make_detector")
    for (rig, length), group in ours.groupby(["rig", "length"], sort=False):
        rows.append({"rig": rig, "row": length} | _rates(group))
    parts += [
        "**`make_detector`, all speeds but the tested one**",
        markdown(pd.DataFrame(rows)),
    ]
    return "\n\n".join(parts)


def _rates(group):
    is_healthy = group["condition"].str.lower().isin(["n", "normal", "healthy"])
    false = group[is_healthy]
    missed = group[~is_healthy]
    cells = {}
    for rate in (0.01, 0.05):
        below = f"below {rate:g}"
        of_speed = false.groupby(["rig", "at", "rpm"])[[below, "rows"]].sum()
        alarms = 100 * of_speed[below] / of_speed["rows"]
        name = f"stated {100 * rate:g} %"
        cells[f"{name}: false alarms, %"] = f"{alarms.mean():.1f}"
        cells[f"{name}: at the worst speed"] = f"{alarms.max():.0f}"
        found = 100 * missed[below].sum() / missed["rows"].sum()
        cells[f"{name}: missed, %"] = f"{100 - found:.1f}"
    return cells


def missed_families(lines):
    """Tabulate the conditions that are missed most."""
    lines = _chosen(lines, method="make_detector", calibrated="left out", length="1 s")
    is_healthy = lines["condition"].str.lower().isin(["n", "normal", "healthy"])
    total = (
        lines[~is_healthy].groupby(["rig", "condition"])[["rows", "below 0.01"]].sum()
    )
    missed = (100 * (1 - total["below 0.01"] / total["rows"])).rename("missed, %")
    table = missed.sort_values(ascending=False).head(_MOST_ROWS).reset_index()
    return (
        "Conditions that `make_detector` misses most, rows of a second, stated rate 1 %, all "
        f"speeds but the tested one.\n\n{markdown(table, digits=0)}"
    )


def unknown(lines):
    """Tabulate rejected rows of known and unknown conditions, noise and another rig."""
    total = lines.groupby(["rig", "length", "tested at", "rows of"], sort=False)
    total = total[["rows", "below 0.01"]].sum()
    share = (100 * total["below 0.01"] / total["rows"]).unstack("rows of")
    return (
        "Rows that are rejected at a stated rate of 1 %, in percent. Rows of one speed train, "
        "and each condition is left out in turn.\n\n"
        + markdown(share.reset_index(), digits=0)
    )


def published(lines):
    """Tabulate printed and computed figures, with differences and rivals ahead of ours."""
    rows = []
    for table, printed in PRINTED.items():
        here = _chosen(lines, table=table)
        rows.append(
            {"table": table, "printed": printed.figures}
            | _published_cells(here, printed.best)
            | {"the same": printed.same, "differs": printed.differs}
        )
    return markdown(pd.DataFrame(rows).fillna(""))


def _published_cells(lines, best):
    """Return ours and the best peer of one table, and what ours is ahead of."""
    texts = {}
    shares_of = {}
    for method, group in lines.groupby("method", sort=False):
        if "AUROC" in group and group["AUROC"].notna().any():
            shares_of[method] = group["AUROC"].mean()
            worst = f"least {group['AUROC'].min():.3f}, {len(group)} runs"
            texts[method] = f"{method} {shares_of[method]:.3f} ({worst})"
        else:
            right, rows = int(group["right"].sum()), int(group["rows"].sum())
            shares_of[method] = right / rows
            texts[method] = f"{method} {right / rows:.3f} ({right} of {rows})"
    ours = [method for method in texts if method.startswith("make_")]
    peers = [method for method in texts if method not in ours]
    if not texts:
        return {"ours": "not computed"}
    peer = max(peers, key=shares_of.get)
    rivals = {"the printed figure": best, "the peer": shares_of[peer]}
    behind = []
    for method in ours:
        lost = [name for name, share in rivals.items() if share > shares_of[method]]
        if lost:
            behind.append(f"{method}: {' and '.join(lost)}")
    return {
        "ours": "; ".join(texts[method] for method in ours),
        "best peer, computed here": texts[peer],
        "ours is behind": "; ".join(behind) or "none",
    }


def published_overview(lines):
    """Tabulate printed and computed figures without the differences."""
    rows = [
        {"table": table, "printed": printed.figures}
        | _published_cells(_chosen(lines, table=table), printed.best)
        for table, printed in PRINTED.items()
    ]
    return markdown(pd.DataFrame(rows).fillna(""))


def runs_to_failure(lines):
    """Tabulate the time of the last alarm, and the fault that is named."""
    detector = _chosen(lines, method="detector", **{"healthy snapshots": "all"})
    named = _chosen(lines, method="bearing").set_index(["run", "channel"])
    few = _chosen(lines, method="detector", **{"healthy snapshots": "5"})
    few = few.set_index(["run", "channel"])
    keys = list(detector[["run", "channel"]].itertuples(index=False, name=None))
    table = pd.DataFrame(
        {
            "run": detector["run"],
            "channel": detector["channel"],
            "alarm, s before the end": detector["alarm"].map(_whole),
            "with 5 healthy snapshots": [_whole(few.loc[key, "alarm"]) for key in keys],
            "alarms that went off": detector["before"].map(_whole),
            "snapshots that exceed before": detector["exceed"],
            "name at the end": [named.loc[key, "name"] for key in keys],
            "name for the last s": [_whole(named.loc[key, "since"]) for key in keys],
        }
    )
    return markdown(table, digits=2)


def _whole(number):
    return "" if pd.isna(number) else f"{number:.0f}"


def signal_quality(lines):
    """Tabulate refused rows by treatment and length."""
    total = lines.groupby(["group", "length"], sort=False)[["rows", "refused"]].sum()
    share = (100 * total["refused"] / total["rows"]).unstack("length", sort=False)
    table = share.reset_index().rename(columns={"group": "rows of"})
    n_rows = lines["rows"].sum()
    kinds = lines[lines["group"] == "damaged"]
    of_kind = kinds.groupby("treatment")[["rows", "refused"]].sum()
    least = (of_kind["refused"] / of_kind["rows"]).sort_values().head(3)
    weakest = "; ".join(f"{kind} {100 * share:.0f} %" for kind, share in least.items())
    return (
        f"Rows that are refused, in percent of {n_rows} rows of eight rigs. Good rows pass a "
        "sensor or logger and should not be refused; damaged rows should.\n\n"
        f"{markdown(table, digits=1)}\n\nKinds of damage that are refused least: {weakest}."
    )


def dots(path, tables, label):
    """Draw a panel of methods for each table: a dot for each rig, a line at the mean."""
    heights = [len(table) for table in tables.values()]
    size = (7.5, 0.9 + 0.24 * sum(heights))
    options = {"sharex": True, "height_ratios": heights}
    with saved_figure(path, len(tables), size=size, **options) as axes:
        for ax, (title, table) in zip(axes[:, 0], tables.items(), strict=True):
            for height, (name, row) in enumerate(table[::-1].iterrows()):
                values = row.to_numpy(dtype=float)
                color = BLUE if name.startswith("make_") else GREY
                ax.plot(values, np.full(len(values), height), "o", ms=3, color=color)
                ax.plot([np.nanmean(values)], [height], "D", ms=6, color=ORANGE)
            ax.set_yticks(range(len(table)), list(table.index[::-1]), fontsize=8)
            ax.set_title(title, fontsize=9, loc="left")
            ax.grid(axis="x")
        axes[-1, 0].set_xlabel(f"{label}; small: a rig, large: mean of the rigs")


def _rig_columns(table, rigs):
    table = table.set_index("method")
    return table[[rig for rig in rigs if rig in table]]


def draw_cross_speed(lines, path):
    """Draw accuracies of windows of 1200."""
    table = _shown(_of_length(lines, "1200"), [*OURS, *BATCH, "MiniRocket"])
    tables = {"rows of 1200 samples": _rig_columns(table, SIX_RIGS)}
    dots(path, tables, "share of right verdicts at other speeds")


def draw_another_bearing(lines, path):
    """Draw accuracies on another bearing."""
    table = _at_bearing(lines, bearing.ANOTHER_SPEED)
    tables = {bearing.ANOTHER_SPEED: _rig_columns(table, bearing.SPECIMEN_RIGS)}
    dots(path, tables, "share of right fault locations")


def draw_calibration(lines, path):
    """Draw how far the mean stated probability is from the share of right verdicts."""
    ours = _chosen(lines, method="make_diagnoser")
    ours = ours[ours["rig"].isin(SIX_RIGS)]
    table = calibrated(ours, ["trained at", "length", "rig"])
    table["off"] = table["stated on average"] - table["right"]
    tables = {}
    for trained, group in table.groupby("trained at", sort=False):
        of_length = group.pivot_table(index="length", columns="rig", values="off")
        tables[f"trained at {trained}"] = of_length
    dots(path, tables, "mean probability less share of right verdicts")


def speed(lines):
    """Tabulate all rows of the speed benchmark."""
    table = lines[["what", "ours", "measured", "spread"]]
    return markdown(table, digits=2)
