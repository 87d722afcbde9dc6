"""The page to solder by: the board's print, and every part that lights up where it belongs."""

from __future__ import annotations

import csv
import json
import re
from collections import defaultdict
from html import escape

# The picture's corner against the sheet's, mm: KiCad frames the board with the Mega's USB shell.
_CORNER_MM = (53.60, 43.96)
_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Shield: where each part goes</title><style>
body{margin:0;font:15px sans-serif;display:flex}
#board{flex:1;height:100vh}#board svg{width:100%;height:100%}
#list{width:24em;height:100vh;overflow:auto;border-left:1px solid #999}
table{border-collapse:collapse;width:100%}td{padding:3px 6px;border-bottom:1px solid #ddd}
tr{cursor:pointer}tr.on{background:#fd6}tr.done td{color:#aaa}
</style></head><body><div id="board">BOARD</div><div id="list">
<p style="margin:6px">Click a line: its parts light up. Click the box when they are soldered.
Never built; CERN-OHL-P-2.0.</p><table>ROWS</table></div><script>
const at=PLACES,svg=document.querySelector("#board svg");
function show(row){document.querySelectorAll("tr.on").forEach(r=>r.classList.remove("on"));
 row.classList.add("on");svg.querySelectorAll(".spot").forEach(s=>s.remove());
 for(const ref of row.dataset.refs.split(" ")){
  const c=document.createElementNS(svg.namespaceURI,"circle");
  c.setAttribute("class","spot");c.setAttribute("cx",at[ref][0]);c.setAttribute("cy",at[ref][1]);
  c.setAttribute("r",2.2);c.setAttribute("fill","#f80");c.setAttribute("fill-opacity",0.55);svg.append(c)}}
document.querySelectorAll("tr").forEach(r=>{r.onclick=()=>show(r);
 r.querySelector("input").onclick=e=>{e.stopPropagation();r.classList.toggle("done",e.target.checked)}});
</script></body></html>
"""


def page(picture: str, places_csv: str) -> str:
    """Return the page.

    Parameters
    ----------
    picture
        SVG of the board's print.
    places_csv
        KiCad's pick-and-place file, mm.
    """
    places: dict[str, tuple[float, float]] = {}
    groups: dict[tuple[str, str], list[str]] = defaultdict(list)
    for row in csv.DictReader(places_csv.splitlines()):
        place = (float(row["PosX"]) - _CORNER_MM[0], -float(row["PosY"]) - _CORNER_MM[1])
        places[row["Ref"]] = (round(place[0], 2), round(place[1], 2))
        groups[row["Package"].split("_")[0], row["Val"]].append(row["Ref"])
    rows = "".join(
        f'<tr data-refs="{" ".join(refs)}"><td><input type="checkbox"></td>'
        f"<td>{escape(value)}</td><td>{' '.join(refs)}</td></tr>\n"
        for (_, value), refs in sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    )
    drawn = picture[picture.index("<svg") :]
    # KiCad's pale layer colours are made for a dark screen.
    drawn = drawn.replace("#F2EDA1", "#333333").replace("#D864FF", "#C08000")
    drawn = re.sub(r'width="[^"]*mm" height="[^"]*mm" ', "", drawn, count=1)
    return _PAGE.replace("ROWS", rows).replace("PLACES", json.dumps(places)).replace("BOARD", drawn)
