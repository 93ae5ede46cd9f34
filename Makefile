# Everything runs in .venv, which tools/bootstrap.py makes and keeps up to date.

PYTHON ?= python3
BIN := .venv/bin

# Discovery stays on this machine unless the caller wants otherwise.
export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST

# .venv stands on its own: the paths of a sourced ROS, or of another such environment, would mix in
# libraries of another build. For a sourced ROS use `colcon build` instead of make.
ifneq ($(AMENT_PREFIX_PATH)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH
unexport RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
endif

.PHONY: help run test lint format interfaces clean
.DEFAULT_GOAL := help

help:
	@echo "make run         optimise a gait and stream it: the demonstration"
	@echo "make test        run the tests; ARGS='-k name' picks some"
	@echo "make lint        ruff and mypy"
	@echo "make format      let ruff format the code"
	@echo "make interfaces  make .venv and build the ROS interfaces, nothing else"
	@echo "make clean       remove .venv and what builds left behind; log/ stays, for it holds recordings"

interfaces:
	@$(PYTHON) tools/bootstrap.py

run: interfaces
	$(BIN)/walk-optimizer demo $(ARGS)

test: interfaces
	$(BIN)/python -m pytest $(ARGS)

lint: interfaces
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: interfaces
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# Not log/: the demonstration's bags are there, beside the logs of colcon.
clean:
	rm -rf .venv build install dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis
