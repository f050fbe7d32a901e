from sklearn.pipeline import make_pipeline

from skarxlag import ARXLaguerre, PIObserver, ThresholdLadder, make_alpio
from skarxlag.commands.diagnosers import set_threads


def test_threads_are_set_in_the_pipeline_and_in_its_steps():
    diagnoser = make_alpio(n_jobs=3)
    set_threads(diagnoser, 2)
    assert diagnoser.n_jobs == diagnoser["identify"].n_jobs == diagnoser["observe"].n_jobs == 2
    plain = make_pipeline(ARXLaguerre(), PIObserver(), ThresholdLadder())
    set_threads(plain, 2)
    assert plain[0].n_jobs == plain[1].n_jobs == 2
