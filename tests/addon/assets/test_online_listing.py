# SPDX-License-Identifier: GPL-3.0-or-later
"""The library behind a web server: Blender 5.2 writes its listing, and reads it back through a static server, as
docs/presets.md tells."""

import functools
import hashlib
import importlib
import json
import subprocess
import sys
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import bpy
import pytest

from precompute.presets.presets import read_preset

pytestmark = pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="asset_listing is new in Blender 5.2")

PRESETS = ("gold_foil",)
SIZE_MAX = 8 << 20
# As `blender --command asset_listing generate FOLDER`.
GENERATE = """
import sys, bpy
from _bpy_internal.assets.remote_library import cli
cli.main(["--quiet", "generate", sys.argv[1]])
"""
# As Blender's Asset Browser does. `asset_listing download` of Blender 5.2.2 passes its arguments in the wrong order.
DOWNLOAD = """
import sys, time, bpy
from _bpy_internal.assets.remote_library.listing_downloader import RemoteAssetListingDownloader
done = []
places = {"remote_url": sys.argv[1], "local_path": sys.argv[2]}
if bpy.app.version >= (5, 3, 0):
    places["auth_token"] = ""
download = RemoteAssetListingDownloader(
    **places, on_update_callback=lambda *_: None, on_done_callback=done.append
)
download.download_and_process()
for _ in range(600):
    download.on_timer_event()
    if done:
        break
    time.sleep(0.1)
print(download.status.value, flush=True)
"""


def run(code, *arguments):
    """Run code with a Blender of its own; returns what it prints."""
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def listed(extension, tmp_path_factory):
    """The folder of a library with its listing."""
    folder = tmp_path_factory.mktemp("library")
    assert bpy.ops.grating.make_assets(directory=str(folder), presets=",".join(PRESETS)) == {"FINISHED"}
    run(GENERATE, folder)
    yield folder
    bpy.ops.grating.remove_assets(directory=str(folder))


def parsed(name, path):
    """A file of the listing as Blender's own parser reads it; it raises for a file that does not fit."""
    package = "_bpy_internal.assets.remote_library"
    models = importlib.import_module(f"{package}.blender_asset_library_openapi")
    parser = importlib.import_module(f"{package}.json_parsing").ValidatingParser()
    return parser.parse_and_validate(getattr(models, name), path.read_bytes())


def check_file(folder, url, told):
    """A file is there, and has the hash that the listing tells."""
    path = folder / url
    assert told == f"SHA256:{hashlib.sha256(path.read_bytes()).hexdigest()}"
    return path


@pytest.mark.night("tests/addon/assets/test_assets.py")
def test_blender_lists_each_asset_with_its_facts(listed):
    meta = parsed("AssetLibraryMeta", listed / "_asset-library-meta.json")
    index_url = meta.api_versions["v1"]
    index = parsed("AssetLibraryIndexV1", check_file(listed, index_url.url, index_url.hash))
    assert index.asset_count == index.file_count == len(PRESETS)
    (page_url,) = index.pages
    page = parsed("AssetLibraryIndexPageV1", check_file(listed, page_url.url, page_url.hash))
    titles = {read_preset(name).title: f"{name}.blend" for name in PRESETS}
    assert {asset.name: asset.files for asset in page.assets} == {title: [file] for title, file in titles.items()}
    catalogs = {identifier: catalog.path for catalog in index.catalogs for identifier in catalog.uuids}
    for asset in page.assets:
        assert asset.id_type == "MATERIAL" and catalogs[asset.meta.catalog_id] == "Natural Gratings/Foils"
        assert (asset.meta.author, asset.meta.license) == ("Natural Gratings", "CC0")
        assert asset.meta.preferred_import_method == "APPEND" and "foil" in asset.meta.tags
        picture = check_file(listed, asset.thumbnail.url, asset.thumbnail.hash)
        assert picture.read_bytes()[8:12] == b"WEBP"
    for file in page.files:
        assert check_file(listed, file.url or file.path, file.hash).stat().st_size == file.size_in_bytes <= SIZE_MAX


class Quiet(SimpleHTTPRequestHandler):
    """A static server that prints nothing."""

    def log_message(self, *_):
        pass


@pytest.mark.night("tests/addon/assets/test_assets.py")
def test_it_is_read_through_a_static_server(listed, tmp_path):
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(listed)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        printed = run(DOWNLOAD, f"http://127.0.0.1:{server.server_port}/", tmp_path / "seen")
    finally:
        server.shutdown()
        server.server_close()
    assert "finished successfully" in printed
    pages = [json.loads(path.read_text()) for path in Path(tmp_path / "seen").glob("_v1/assets-*.json")]
    assert sum(page["asset_count"] for page in pages) == len(PRESETS)
    assert "Natural Gratings/Foils" in (tmp_path / "seen" / "blender_assets.cats.txt").read_text()
