"""Samplers of Optuna and SMAC, asked and told over standard input and output, a line of JSON each.

    {"begin": {"sampler": NAME, "seed": N, "frames": N, "space": [PARAM, ...]}}   {"ok": true}
    {"ask": true}                                                                 {"config": {NAME: VALUE}}
    {"tell": {"config": {NAME: VALUE}, "cost": C}}                                {"ok": true}

C is null if the configuration failed: samplers are told the worst cost so far.

PARAM: {"name", "kind": "ordinal", "values"} or {"name", "kind": "integer" | "real", "low", "high", "log"},
and perhaps "when": {"name", "values"}, the values of an earlier parameter with which it has a meaning. A
config holds only parameters that have one. What is told need not be what was asked: the nearest recorded
configuration answers. `peers.py --check` prints the samplers that can be had here.
"""

import importlib.util
import json
import sys
import tempfile


def has(*modules):
    return all(importlib.util.find_spec(module) for module in modules)


class Optuna:
    """What is told is added as a finished trial; the trial that was asked counts as failed, which samplers
    take no notice of."""

    def __init__(self, sampler, task):
        import optuna

        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self.optuna = optuna
        self.space = task["space"]
        samplers = optuna.samplers
        seed = task["seed"]
        if sampler == "optuna-tpe":
            sampler = samplers.TPESampler(seed=seed)
        elif sampler == "optuna-tpe-multivariate":
            sampler = samplers.TPESampler(seed=seed, multivariate=True, group=True)
        else:
            sampler = samplers.GPSampler(seed=seed, deterministic_objective=True)
        self.study = optuna.create_study(sampler=sampler)
        self.asked = None

    def distribution(self, param):
        distributions = self.optuna.distributions
        if param["kind"] == "ordinal":
            return distributions.IntDistribution(0, len(param["values"]) - 1)
        if param["kind"] == "integer":
            return distributions.IntDistribution(param["low"], param["high"], log=param["log"])
        return distributions.FloatDistribution(param["low"], param["high"], log=param["log"])

    def ask(self):
        self.asked = self.study.ask()
        config = {}
        for param in self.space:
            if not is_active(param, config):
                continue
            name, kind = param["name"], param["kind"]
            if kind == "ordinal":
                index = self.asked.suggest_int(name, 0, len(param["values"]) - 1)
                config[name] = param["values"][index]
            elif kind == "integer":
                config[name] = self.asked.suggest_int(name, param["low"], param["high"], log=param["log"])
            else:
                config[name] = self.asked.suggest_float(name, param["low"], param["high"], log=param["log"])
        return config

    def tell(self, config, cost):
        if self.asked is not None:
            self.study.tell(self.asked, state=self.optuna.trial.TrialState.FAIL)
            self.asked = None
        own = [param for param in self.space if param["name"] in config]
        self.study.add_trial(
            self.optuna.trial.create_trial(
                params={param["name"]: internal(param, config[param["name"]]) for param in own},
                distributions={param["name"]: self.distribution(param) for param in own},
                value=cost,
            )
        )


class Smac:
    """A random forest with expected improvement: what SMAC recommends for hyperparameters."""

    def __init__(self, _sampler, task):
        import ConfigSpace as cs
        from smac import HyperparameterOptimizationFacade, Scenario

        self.cs = cs
        self.space = task["space"]
        space = cs.ConfigurationSpace(seed=task["seed"])
        params = {}
        for param in self.space:
            name = param["name"]
            if param["kind"] == "ordinal":
                own = cs.UniformIntegerHyperparameter(name, 0, len(param["values"]) - 1)
            elif param["kind"] == "integer":
                own = cs.UniformIntegerHyperparameter(name, param["low"], param["high"], log=param["log"])
            else:
                own = cs.UniformFloatHyperparameter(name, param["low"], param["high"], log=param["log"])
            space.add(own)
            params[name] = (param, own)
            when = param.get("when")
            if when:
                decider, parent = params[when["name"]]
                values = [internal(decider, value) for value in when["values"]]
                space.add(cs.InCondition(own, parent, values))
        self.folder = tempfile.TemporaryDirectory()
        scenario = Scenario(
            space,
            deterministic=True,
            n_trials=task["frames"],
            seed=task["seed"],
            output_directory=self.folder.name,
        )
        self.smac = HyperparameterOptimizationFacade(
            scenario, lambda config, seed=0: 0.0, overwrite=True, logging_level=False
        )
        self.configspace = space
        self.seed = 0

    def ask(self):
        info = self.smac.ask()
        self.seed = info.seed
        by_name = {param["name"]: param for param in self.space}
        return {name: external(by_name[name], value) for name, value in dict(info.config).items()}

    def tell(self, config, cost):
        from smac.runhistory.dataclasses import TrialInfo, TrialValue

        by_name = {param["name"]: param for param in self.space}
        values = {name: internal(by_name[name], value) for name, value in config.items()}
        own = self.cs.Configuration(self.configspace, values=values)
        self.smac.tell(TrialInfo(own, seed=self.seed), TrialValue(cost=cost), save=False)


def is_active(param, config):
    when = param.get("when")
    return when is None or config.get(when["name"]) in when["values"]


def internal(param, value):
    """Values of an ordinal are numbered for the samplers."""
    return param["values"].index(value) if param["kind"] == "ordinal" else value


def external(param, value):
    if param["kind"] == "ordinal":
        return param["values"][int(value)]
    return int(value) if param["kind"] == "integer" else float(value)


SAMPLERS = {
    "optuna-tpe": (Optuna, ["optuna"]),
    "optuna-tpe-multivariate": (Optuna, ["optuna"]),
    "optuna-gp": (Optuna, ["optuna", "torch", "scipy"]),
    "smac-forest": (Smac, ["smac", "ConfigSpace"]),
}


def main():
    if sys.argv[1:] == ["--check"]:
        for name, (_, modules) in SAMPLERS.items():
            if has(*modules):
                print(name)
        return
    # Libraries that print would disturb the lines.
    answers, sys.stdout = sys.stdout, sys.stderr
    peer, worst = None, 1.0
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if "begin" in request:
                task, worst = request["begin"], 1.0
                peer = SAMPLERS[task["sampler"]][0](task["sampler"], task)
                answer = {"ok": True}
            elif "ask" in request:
                answer = {"config": peer.ask()}
            else:
                cost = request["tell"]["cost"]
                worst = max(worst, cost or 0.0)
                peer.tell(request["tell"]["config"], worst if cost is None else cost)
                answer = {"ok": True}
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
