"""What people do with each command: examples for its help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Example = tuple[str, str]
"""A command as it is typed, and what it does."""

EXAMPLES: Mapping[str, Sequence[Example]] = {
    "curveline": (
        ("curveline simulate shapes/level-up-peak.toml", "every curve that a rod can take between two nodes"),
        ("curveline send shapes/level-up-peak.toml --radio mock", "bring a model of a display into that shape"),
    ),
    "curveline simulate": (
        ("curveline simulate shapes/level-up-peak.toml", "a table and a drawing"),
        ("curveline simulate shapes/*.toml --brief", "a line per segment of many shapes"),
        (
            "curveline simulate shapes/level-up-peak.toml -o peak.csv -o peak.svg",
            "the curves as points and as a figure",
        ),
        (
            "curveline simulate level-asymmetric-peak --after level-asymmetric-valley@8h",
            "with the set that eight hours in another shape leave in a plastic rod",
        ),
        (
            "curveline simulate shapes/level-up-peak.toml --sweep nodes.1.angle_deg=-30:30:21",
            "which states there are while an angle changes",
        ),
    ),
    "curveline fit": (
        (
            "curveline fit shapes/drawings/hill.svg --curve hill -o hill.toml -o hill.svg",
            "the shape of the display single that is nearest to a drawn hill, and a figure of both",
        ),
        (
            'curveline fit --formula "80*sin(pi*x/2000)" --display quad -o bow.toml --plan-file bow.json',
            "a formula in mm over four segments, with the plan that leads there",
        ),
        (
            "curveline fit shapes/drawings/roof.dxf -d quad --minimise max --within-mm 5 --brief",
            "the largest distance made small; exit code 1 if it is over 5 mm",
        ),
    ),
    "curveline surface": (
        (
            'curveline surface --formula "60*sin(pi*x/500)*cos(pi*(y-260)/900)" -o bow',
            "eight lines of the display single, 75 mm apart, in a folder for `curveline send bow`",
        ),
        (
            "curveline surface bonnet.stl --unit mm --display quad --lines 6 --pitch-mm 120 -o bonnet -o bonnet.png",
            "a mesh as it is seen from above, and a figure of all lines",
        ),
        (
            "curveline surface dunes.png --width-mm 2000 --height-mm 0:150 -d quad --within-mm 5 --brief",
            "a picture whose greys are heights; exit code 1 if a line is more than 5 mm off",
        ),
    ),
    "curveline plan": (
        (
            "curveline plan shapes/staggered-down-peak.toml -o plan.json",
            "the steps from home, as text and as a file to send",
        ),
        ("curveline plan plan.json --brief", "what a plan comes to, in a few lines"),
        (
            "curveline plan shapes/level-up-peak.toml shapes/level-down-valley.toml --home",
            "two shapes in a row, and home",
        ),
        ("curveline plan shapes/level-up-peak.toml --monte-carlo 100", "how often it ends well if nodes err"),
    ),
    "curveline send": (
        ("curveline send plan.json --radio mock -n", "what would be sent; nothing moves"),
        (
            "curveline send shapes/level-up-peak.toml --radio serial:/dev/ttyACM0",
            "plan from where the display stands, ask, and send",
        ),
        (
            'curveline send level-up-peak --radio serial:/dev/ttyACM0 --verify "rpicam-still -n -o {}" '
            "--camera camera.toml --recover 2",
            "take a picture when it is done, and lead a wrong state back",
        ),
        ("curveline send roof", "several displays in one run, as roof/lines.toml says"),
        ("curveline send --resume last --radio mock", "go on with a run that was cut short"),
        ("curveline send --home --radio mock --yes", "bring the display home, without a question"),
    ),
    "curveline watch": (
        (
            'curveline watch "rpicam-still -n -o {}" level-up-peak --camera camera.toml --every-s 10',
            "say when somebody snaps the rod over",
        ),
        ("curveline watch mock level-up-peak --radio mock --count 1", "what the mock display shows now"),
    ),
    "curveline compare": (
        ("curveline compare trials -o panel.svg", "all trials of a folder beside the model, and a figure of them"),
        (
            "curveline compare level-up-peak monday.csv tuesday.csv --max-rmse-mm 7",
            "two trials of a shape; exit code 1 if they are more than 7 mm off",
        ),
    ),
    "curveline status": (
        ("curveline status --radio mock", "every node in a row of a table"),
        ("curveline status --radio mock --brief", "a line per node, for scripts to look through"),
        ("curveline status --radio serial:/dev/ttyACM0 --watch", "again every second, until Ctrl-C"),
    ),
    "curveline stop": (("curveline stop --radio mock", "hold all nodes, whoever moves them"),),
    "curveline rod": (
        ("curveline rod --radio mock", "what the rod went through, and what is left of it"),
        ("curveline rod --radio mock --new", "a new rod is in the display"),
    ),
    "curveline load": (
        (
            "curveline load shapes/level-neutral-peak.toml --at 0.35",
            "push at a third of the rod's length, until it snaps",
        ),
        ("curveline load shapes/level-up-peak.toml --map --points 11", "where the shape is weakest"),
    ),
    "curveline atlas": (
        ("curveline atlas single", "which states there are over the angle of both nodes and the length"),
        (
            "curveline atlas single --over rise_mm --over length_mm=510:700:39 --at left_deg=20 -o atlas.svg",
            "over the rise and the length, as a figure",
        ),
        ("curveline atlas quad -o atlas.npz --jobs 2", "as arrays, curves too, computed by two processes"),
    ),
    "curveline bench": (
        ("curveline bench --quick", "what is held against goals"),
        ("curveline bench --quick --compare last", "and what became slower since the last time"),
        ("curveline bench --link", "the radio link, on a model of the radios"),
    ),
    "curveline keys": (("curveline keys new", "once per site"),),
    "curveline keys new": (("curveline keys new", "make the site's keys, in the usual place"),),
    "curveline keys node": (
        (
            "curveline keys node 1 --hex firmware/build/node.hex -o node1.hex",
            "the program of node 1 of display single, ready to be flashed",
        ),
    ),
    "curveline keys adopt": (
        ("curveline keys adopt --radio serial:/dev/ttyACM0", "learn which chip listens where"),
        ("curveline keys adopt --radio mock:keys --yes", "the same with a model of the display, to try it"),
    ),
    "curveline keys show": (("curveline keys show", "where the keys are, and which nodes are known"),),
    "curveline node": (
        ("curveline node status 1 --radio mock", "all about the first node"),
        ("curveline node check 1 --radio mock --yes", "whether its motors and encoders are wired rightly"),
    ),
    "curveline node status": (("curveline node status 1 --radio mock", "all about the first node"),),
    "curveline node clear": (("curveline node clear 2 --radio mock", "end the fault of the second node"),),
    "curveline node info": (("curveline node info 1 --radio mock", "address, channel, firmware, limits"),),
    "curveline node blink": (("curveline node blink 2 --radio mock", "see which one is the second node"),),
    "curveline node jog": (
        ("curveline node jog 1 bias -5 --radio mock", "turn the first node back by 5 degrees"),
        ("curveline node jog 1 translate 10 --unhomed --radio mock", "lift it, although it has not been homed"),
    ),
    "curveline node zero": (("curveline node zero 1 --radio mock", "the rod is threaded: it counts from here"),),
    "curveline node watch": (
        ("curveline node watch 1 --radio mock --seconds 1", "counts, switches and supply, for a second"),
    ),
    "curveline node check": (
        ("curveline node check 1 bias --radio mock --yes", "one motor, with no other plugged in"),
        ("curveline node check 1 --radio mock:reversed=bias@1 --yes", "a model of a board that is wired wrongly"),
    ),
    "curveline node calibrate": (
        (
            "curveline node calibrate 1 extrude --times 2 --measured 49.9 --measured 50.1 --radio mock --yes",
            "what a turn of its gear makes, by a ruler",
        ),
    ),
    "curveline node tune": (("curveline node tune 1 bias --radio mock --yes", "how its motor answers to duty"),),
    "curveline node settings": (
        ("curveline node settings --radio mock --yes", "all nodes get what the display file says"),
        (
            "curveline node settings 2 --old-channel 23 --radio mock:channel=2 --yes",
            "one that listens on another channel",
        ),
    ),
    "curveline node update": (
        (
            "curveline node update 1 --hex firmware/build/updatable.hex --yes",
            "another program, over the air",
        ),
    ),
    "curveline node home": (("curveline node home 2 --radio mock --yes", "find the zeros of the second node"),),
    "curveline radio": (("curveline radio scan --radio mock:noise=13 --seconds 20", "which channel is quiet"),),
    "curveline radio scan": (
        ("curveline radio scan --radio mock:noise=13 --seconds 20", "which channel is quiet, beside a busy WLAN"),
        ("curveline radio scan --radio mock --seconds 20 -o band.svg", "a bar for each channel"),
    ),
    "curveline radio range": (
        ("curveline radio range 1 --radio mock:weak=12 --seconds 20", "how a node is heard with each power"),
        ("curveline radio range 1 --radio mock --level max --seconds 20 -o range.svg", "with that of runs alone"),
    ),
    "curveline radio log": (
        ("curveline radio log --seconds 1", "all that other commands send and hear meanwhile"),
        ("curveline radio log --seconds 1 --node 2 --type status --json", "what the second node says of itself"),
    ),
    "curveline display": (("curveline display check single", "what a built-in display can do"),),
    "curveline display check": (
        ("curveline display check single", "what a built-in display can do"),
        ("curveline display check mine.toml", "whether a file of your own is sound"),
    ),
    "curveline display show": (("curveline display show single > mine.toml", "a file to start from"),),
    "curveline camera": (
        ("curveline camera board -o board.pdf -o camera.toml", "what to print, to begin with"),
        ("curveline camera calibrate lens/*.jpg -o camera.toml", "the lens, from pictures of the printed board"),
    ),
    "curveline camera board": (
        (
            "curveline camera board -d single -o board.pdf -o camera.toml",
            "pages to print, and a file for where tags are",
        ),
        ("curveline camera board --paper letter --tag-mm 60 -o board.svg", "an SVG drawing of each page"),
    ),
    "curveline camera calibrate": (
        ("curveline camera calibrate lens/*.jpg -o camera.toml", "the lens, from twelve pictures of the board"),
        ("curveline camera calibrate lens/*.heic --json", "what each picture is good for, for a script"),
    ),
    "curveline camera pose": (
        ("curveline camera pose trial.jpg --camera camera.toml", "where the camera stood, and how far off each tag is"),
    ),
    "curveline calibrate": (
        ("curveline calibrate rod trials -o mine.toml", "rod, bearings and nodes, from trials of shapes"),
        ("curveline calibrate set strip.csv", "what set a rod takes, from readings of strips"),
    ),
    "curveline calibrate rod": (
        ("curveline calibrate rod trials", "what trials of several shapes tell of their display, and how sure that is"),
        (
            "curveline calibrate rod trials --droop 300,60 -o mine.toml -o mine.svg",
            "with a rod that was hung over an edge; written into a display file, and a figure",
        ),
    ),
    "curveline calibrate set": (
        ("curveline calibrate set strip.csv", "what set a rod takes, and how sure that is"),
        ("curveline calibrate set strip.csv -o mine.toml", "the same, written into a display file"),
    ),
    "curveline runs": (
        ("curveline runs --brief", "a line per run, the newest first"),
        ("curveline runs show last", "the log of the newest"),
    ),
    "curveline runs show": (("curveline runs show last", "the log of the newest run"),),
    "curveline shapes": (
        ("curveline shapes", "what there is"),
        ("curveline simulate level-up-peak", "one of them, by its name"),
    ),
    "curveline new": (
        ("curveline new shape arch --state valley", "a shape in arch.toml"),
        ("curveline new display lab --nodes 3", "a display in lab.toml"),
    ),
    "curveline new shape": (
        ("curveline new shape arch --state valley", "a shape in arch.toml"),
        ("curveline new shape arch --display lab.toml -o -", "one for a display of your own, on stdout"),
    ),
    "curveline new display": (("curveline new display lab --nodes 3", "a display in lab.toml"),),
}
