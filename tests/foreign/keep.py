"""What a program of this folder writes: written where it differs, or checked."""

import sys


def keep(folder, files, usage):
    """Writes `files`, a text for each name below `folder`; with --check only says which differ (exit status 1)."""
    if sys.argv[1:] not in ([], ["--check"]):
        sys.exit(usage)
    folder.mkdir(exist_ok=True)
    differing = [name for name, text in files.items() if not (folder / name).exists() or (folder / name).read_text() != text]
    if "--check" in sys.argv:
        sys.exit("differs from what is written: " + ", ".join(differing) if differing else 0)
    for name in differing:
        (folder / name).write_text(files[name])
        print("wrote", name)
