"""tests/style/check_docs notices every kind of fault that it looks for, and accepts a page without any."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = pathlib.Path(__file__).parent / "check_docs"
GOOD = """# A page

See [the heading](#a-page), `config/arm.yaml` and `Suite.Name`; `out/log.csv` is made by running something.

```sh
softarm check config/arm.yaml
```
"""


class CheckDocs(unittest.TestCase):
    def check(self, page):
        """Exit code and output of the check of a project with one page."""
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name)
            (root / "config").mkdir()
            (root / "config/arm.yaml").write_text("name: arm\n", encoding="utf-8")
            (root / "tests").mkdir()
            (root / "tests/some_test.cpp").write_text("TEST_F(Suite, Name) {}\n", encoding="utf-8")
            (root / "page.md").write_text(page, encoding="utf-8")
            done = subprocess.run([sys.executable, "-B", CHECK, root], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    def test_a_good_page_passes(self):
        code, printed = self.check(GOOD)
        self.assertEqual(code, 0, printed)

    def test_every_fault_is_noticed(self):
        faults = {
            "[a](no_such_page.md)": "link to no_such_page.md",
            "[a](#no-such-heading)": "no such heading",
            "[a][b]": "link to [b]",
            "`config/no_such.yaml`": "names config/no_such.yaml",
            "`Suite.NoSuchName`": "names the test Suite.NoSuchName",
            "a " * 61: "has 122 characters",
            "```\nx\n```": "code block of language ''",
            "```sh\nx\n": "a code block has no end",
            "It starts an" + "ew.": "write: again",
        }
        for fault, complaint in faults.items():
            with self.subTest(fault=fault):
                code, printed = self.check(f"{GOOD}\n{fault}\n")
                self.assertEqual(code, 1)
                self.assertIn(complaint, printed)


if __name__ == "__main__":
    unittest.main()
