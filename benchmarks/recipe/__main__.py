"""``python -m benchmarks.recipe COMMAND ...``."""

from benchmarks.commands import run_command

COMMANDS = {
    "ablation": "benchmarks.recipe.ablation",
    "confidence": "benchmarks.recipe.confidence",
    "speed-effects": "benchmarks.recipe.speed_effects",
}

if __name__ == "__main__":
    run_command("benchmarks.recipe", COMMANDS)
