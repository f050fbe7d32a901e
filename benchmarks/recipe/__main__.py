"""``python -m benchmarks.recipe COMMAND ...``."""

from benchmarks.commands import run_command

COMMANDS = {
    "ablation": "benchmarks.recipe.ablation",
    "battery": "benchmarks.recipe.battery",
    "confidence": "benchmarks.recipe.confidence",
    "recording-evidence": "benchmarks.recipe.recording_evidence",
    "constants": "benchmarks.recipe.constants",
    "sensitivity": "benchmarks.recipe.sensitivity",
    "stretches": "benchmarks.recipe.stretches",
    "speed-effects": "benchmarks.recipe.speed_effects",
    "targets": "benchmarks.recipe.targets",
}

if __name__ == "__main__":
    run_command("benchmarks.recipe", COMMANDS)
