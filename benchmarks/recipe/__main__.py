"""``python -m benchmarks.recipe COMMAND ...``."""

from benchmarks.commands import run_command

COMMANDS = {
    "ablation": "benchmarks.recipe.ablation",
    "recording-evidence": "benchmarks.recipe.recording_evidence",
    "constants": "benchmarks.recipe.constants",
    "targets": "benchmarks.recipe.targets",
}

if __name__ == "__main__":
    run_command("benchmarks.recipe", COMMANDS)
