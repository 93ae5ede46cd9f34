"""No data becomes code: nothing in the sources unpickles, evaluates, or goes through a shell."""

import ast
from pathlib import Path

import pytest

import walk_optimizer

PACKAGE = Path(walk_optimizer.__file__).parent
FILES = sorted(PACKAGE.rglob("*.py"))

FORBIDDEN_MODULES = {
    "pickle",
    "cPickle",
    "dill",
    "cloudpickle",
    "joblib",
    "shelve",
    "marshal",
    "pty",
    "commands",
}
FORBIDDEN_CALLS = {
    "eval",
    "exec",
    "compile",
    "__import__",
    "os.system",
    "os.popen",
    "os.execvp",
    "os.spawnl",
    "subprocess.getoutput",
    "subprocess.getstatusoutput",
    "yaml.load",
    "yaml.full_load",
    "yaml.unsafe_load",
    "np.load",
    "numpy.load",
    "torch.load",
    "asyncio.create_subprocess_shell",
}


def findings(source):
    """What a source does that is forbidden, with the line."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        else:
            names = []
        found += [(node.lineno, name) for name in names if name.split(".")[0] in FORBIDDEN_MODULES]
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            if called in FORBIDDEN_CALLS:
                found.append((node.lineno, called))
            for keyword in node.keywords:
                if keyword.arg in ("shell", "allow_pickle") and ast.unparse(keyword.value) != "False":
                    found.append((node.lineno, f"{called}({keyword.arg}=...)"))
    return found


def test_no_source_turns_data_into_code():
    found = {str(path.relative_to(PACKAGE)): findings(path.read_text(encoding="utf-8")) for path in FILES}
    assert len(found) > 100
    assert {path: lines for path, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from pickle import loads",
        "eval(text)",
        "subprocess.run(text, shell=True)",
        "np.load(path)",
        "numpy.savez(path, allow_pickle=True)",
        "yaml.load(text)",
        "os.system(text)",
    ],
)
def test_the_scan_finds_what_it_looks_for(source):
    assert len(findings(source)) == 1
