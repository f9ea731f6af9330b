"""The default method: infer a model from few trials. Every sample is kept and judged again.

Classifiers tell the samples of models from those of the agents. A model theta is right if every
classifier c judges it as it judges the agents. With p_c(theta) for the mean output of c for samples
of theta, and q_c for that for the agents', this is one equation for each classifier:

    p_c(theta) = q_c
    (1)

There are a few hundred classifiers for a few parameters. Some evolve, so that they see what tells
models from agents now; others, the observers, are random, so that they see what no classifier has
learned to see. How p_c depends on theta is learned from all trials so far, by Gaussian processes.
They say what is expected, and how surely. So the equations need not hold exactly, but as far as
samples can tell. With m(theta) for the expectations, and C for their covariance together with that
of q, parameters are the right ones with the density

    log density = -1/2 (m(theta) - q)' C(theta)^-1 (m(theta) - q) - 1/2 log det C(theta)
    (2)

A run goes in batches (`FewTrials.step`): (1) models are tried, and their samples kept; (2)
classifiers evolve, and all judge the samples again; (3) outputs are condensed to moments, one for
each parameter and for each product of two that shows, which are 0 on average for a right model
(`_jurors`); (4) Gaussian processes map the moments (`_map`); (5) walkers follow the density (2),
and the next batch is tried around them (`_design`). A run whose map fits nothing leaves it for
good, and searches from many places (`_search`).

At the end the observers alone are asked, which no model was selected to fool. Their judgments
become one composite for each parameter, which is held against that of the agents as in (2)
(`match`). Draws from this density are the result (`_readout`). No distance between behaviors is
defined, and no summary of them is made by hand. Why which number: docs/decisions/0028.

`FewTrials`, `Batch`
    The loop; what is known after a batch of trials. `batch_schedule`: how many trials are spent
    after each; none has more than one of `FEWEST_BATCHES` parts.
`SearchSpace`
    The space of parameters.
`Symmetry`, `SymmetryGroup`, `walked_symmetries`, `candidate_symmetries`
    A transformation of models; several of them, and what comes of these in turn; what may turn one
    solution of a custom system into another: along which walkers jump, and what is tried.
`Coordinates`, `Ridge`, `ridge_coordinates`, `expressions`
    Coordinates in which a ridge may be straight; what shows along one, and models all along it; those of a custom system;
    what shows in words.
`SampleBuffer`
    All samples of a run.
`Observers`, `PooledClassifier`
    Protocol: random classifiers beside the evolved ones; those that a run has, which judge every
    short stretch.
`MomentField`, `TrialDesign`
    A map of moments over the parameters; walkers that follow a density, and batches of trials
    around them.
`match`, `Matched`, `combined`, `LEAST_P`
    The parameters that match the agents; several solutions as one; a p-value below which it is told
    from the agents.
`modes`
    Solutions apart from each other, among draws of the right model.
`Examiner`, `samples_of`
    Compares new samples of the estimate with the genuine ones; how many these are.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
