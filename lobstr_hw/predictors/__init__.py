"""Predictors: a step is a function (see :mod:`lobstr_hw.predictors.predictor`)."""
