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
    def check(self, page, readme=None, source=""):
        """Exit code and output of the check of a project with one page, a README where there is one, and a line in a source."""
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name)
            (root / "config").mkdir()
            (root / "config/arm.yaml").write_text("name: arm\n", encoding="utf-8")
            (root / "tests").mkdir()
            (root / "tests/some_test.cpp").write_text(f"TEST_F(Suite, Name) {{}}\n{source}\n", encoding="utf-8")
            (root / "page.md").write_text(page, encoding="utf-8")
            (root / "examples").mkdir()
            (root / "examples/loop.cpp").write_text("int main() {\n  a();\n  b();\n}\n", encoding="utf-8")
            if readme:
                (root / "README.md").write_text(readme, encoding="utf-8")
            done = subprocess.run([sys.executable, "-B", CHECK, root], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    def test_a_good_page_passes(self):
        code, printed = self.check(GOOD)
        self.assertEqual(code, 0, printed)

    def test_cpp_in_the_readme_is_part_of_an_example(self):
        self.assertEqual(self.check(GOOD, "```cpp\na();\nb();\n```\n")[0], 0)
        code, printed = self.check(GOOD, "```cpp\na();\nc();\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("no part of a program in examples/", printed)

    def test_words_are_avoided_in_sources_too(self):
        for line in ("// Is to" + "ld.", "TEST_F(Suite, NameThatIsTo" + "ldTwice) {}", 'text("a pl' + 'ate");',
                     "BaseSource::pl" + "ate"):
            with self.subTest(line=line):
                code, printed = self.check(GOOD, source=line)
                self.assertEqual(code, 1)
                self.assertIn("tests/some_test.cpp: line 2 says", printed)
        for line in ('out["cure"] = fix;', "folded, retold", "base_plate: {}", "// the top plate", "a fresh one", "TEST_F(Suite, AFreshName) {}"):
            with self.subTest(line=line):
                code, printed = self.check(GOOD, source=line)
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
