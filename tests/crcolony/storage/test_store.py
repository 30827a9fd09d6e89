"""A robot's memory keeps what it was told, refuses what it cannot use, and goes on when a disk is full again empty."""

import base64
import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from crcolony.errors import FatalStorageError
from crcolony.evolution.history import Event
from crcolony.protocol.encounters import EncounterRecord
from crcolony.storage import schema as robot_schema
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.rows import Decision
from crcolony.storage.sql import StorageError
from crcolony.storage.store import RobotStore, StorageFullError
from tests.support.robot_stores import (
    ME,
    OTHER,
    PEER,
    SCHEMA,
    answered,
    decision,
    events,
    open_store,
    proposed,
    robot,
    room_for,
    see,
)


def mate(store: RobotStore, number: int) -> EncounterRecord:
    record = proposed(number)
    store.write([record], record, decision(number))
    return record


def test_a_new_memory_is_empty(tmp_path: Path) -> None:
    """Nothing is saved, decided, open or known of anybody."""
    store = open_store(tmp_path / "robot.sqlite")
    assert store.load() is None
    assert (store.decisions_since(), store.open_records(), store.marks()) == ([], [], {})
    store.close()


def test_what_is_written_is_read_as_it_was(tmp_path: Path) -> None:
    """Records with and without partner, decisions, events and the whole robot, by the robot and by anybody else."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path, durable=True)
    incarnation = store.begin_incarnation(1000)
    alone = replace(answered(1), partner=None, proof=b"", orphaned=True)
    store.write([alone])
    mated = mate(store, 2)
    store.save(robot(3), events(3), tick=30)
    store.close()
    store = open_store(path)
    saved, tick = store.load() or ({}, 0)
    assert tick == 30
    np.testing.assert_array_equal(saved["arrays"]["weights"], robot(3)["arrays"]["weights"])
    stored = read_stored_robot(path)
    store.close()
    assert (stored.robot, stored.incarnation, stored.schema) == (ME, incarnation, SCHEMA)
    assert stored.matings == [(alone, None), (mated, decision(2))]
    assert stored.events == events(3)
    assert (stored.tick, stored.generation) == (30, 3)
    assert stored.saved_unix_s is not None
    (offspring,) = stored.pool
    assert (offspring.genes.tolist(), offspring.mother, offspring.step) == ([3.0, 3.0], "me/1", 3)


def test_a_record_takes_the_place_of_what_was_known_of_its_encounter(tmp_path: Path) -> None:
    """The decision about offspring stays, and an encounter that is over waits no more."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    record = mate(store, 1)
    store.write([answered(2), answered(3, peer=OTHER)])
    assert store.open_records() == [record, answered(2), answered(3, peer=OTHER)]
    over = [replace(record, state="mated"), answered(2, "aborted")]
    store.write(over)
    assert store.open_records() == [answered(3, peer=OTHER)]
    assert store.decisions_since() == [(over[0], decision(1))]
    store.close()


def test_it_is_decided_once_about_an_encounter(tmp_path: Path) -> None:
    """A second decision is a mistake of the program's, and leaves the memory as it was; so does one about nothing."""
    store = open_store(tmp_path / "robot.sqlite")
    record = mate(store, 1)
    wrongs: tuple[Callable[[], None], ...] = (
        lambda: store.write([record], record, decision(2)),
        lambda: store.write([answered(5), record], record, decision(2)),
        lambda: store.write([answered(5)], record, decision(2)),
        lambda: store.write([answered(5)], answered(5)),
        lambda: store.write([answered(5)], answered(5), replace(decision(2), energy=float("nan"))),
    )
    for wrong in wrongs:
        with pytest.raises(ValueError):
            wrong()
    assert store.decisions_since() == [(record, decision(1))]
    assert store.marks() == {}
    store.close()


def test_marks_tell_of_every_initiator_its_last_encounter(tmp_path: Path) -> None:
    """By life first and count second, whatever the order they were written in, and whether that one was a mating."""
    store = open_store(tmp_path / "robot.sqlite")
    later = answered(1, "aborted")
    later = replace(later, encounter=type(later.encounter)(PEER, ME, 8, 1))
    store.write([later])
    store.write([answered(9, "mated"), answered(4, "mated", peer=OTHER), proposed(30)])
    assert store.marks() == {PEER: ((8, 1), False), OTHER: ((7, 4), True)}
    store.close()


def test_a_life_has_a_larger_number_than_every_life_before(tmp_path: Path) -> None:
    """Though the clock jumps back, and though an earlier memory was lost."""
    path = tmp_path / "robot.sqlite"
    lives = []
    for unix_s in (1000, 2000, 5, 2000, 3000):
        store = open_store(path)
        lives.append(store.begin_incarnation(unix_s))
        store.close()
    assert lives == [1000, 2000, 2001, 2002, 3000]
    path.unlink()
    store = open_store(path)
    assert store.begin_incarnation(3001) == 3001
    store.close()


def test_matings_after_the_snapshot_are_told_in_order(tmp_path: Path) -> None:
    """Those that a snapshot knows of are not, so that no offspring is lost and none comes twice."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 1)
    store.save(robot(1), events(1), tick=1)
    records = [mate(store, number) for number in (5, 3, 4)]
    store.close()
    store = open_store(path)
    assert [record for record, _ in store.decisions_since()] == records
    store.save(robot(2), [], tick=2)
    assert store.decisions_since() == []
    store.close()


def test_a_damaged_snapshot_gives_way_to_the_one_before(tmp_path: Path) -> None:
    """Its events are forgotten, for they are lived again; the matings since the older one are told."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store.save(robot(1), events(1), tick=1)
    record = mate(store, 1)
    store.save(robot(2), events(2), tick=2)
    newest = "(SELECT newest FROM head)"
    store._connection.execute(f"UPDATE snapshots SET robot = x'00' WHERE serial = {newest}")
    store.close()
    store = open_store(path)
    saved, tick = store.load() or ({}, 0)
    assert (tick, saved["generation"]) == (1, 1)
    assert store.decisions_since() == [(record, decision(1))]
    assert read_stored_robot(path).events == events(1)
    store.save(robot(3), events(3)[:1], tick=3)
    assert (see(store).tick, read_stored_robot(path).events) == (3, events(1) + events(3)[:1])
    store.close()
    store = open_store(path)
    assert see(store).tick == 3
    store._connection.execute("UPDATE snapshots SET robot = x'00'")
    store.close()
    with pytest.raises(StorageError, match="no snapshot is undamaged"):
        open_store(path)


@pytest.mark.parametrize("seq", [1, 2, 4])
@pytest.mark.parametrize("table", ["encounters", "events"])
def test_a_lost_row_is_missed(tmp_path: Path, table: str, seq: int) -> None:
    """The first, one in the middle, and the last, which leaves no gap."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store.write([answered(number) for number in range(4)])
    store.save(robot(1), events(1) + events(2), tick=2)
    store._connection.execute(f"DELETE FROM {table} WHERE seq = ?", (seq,))
    store.close()
    for use in (open_store, read_stored_robot):
        with pytest.raises(StorageError, match="corrupt: row"):
            use(path)


WRITER = """
import sys
from pathlib import Path
from tests.support.robot_stores import *
store = open_store(Path(sys.argv[1]), durable=True)
for number in range(10**9):
    record = proposed(number)
    store.write([record], record, decision(number))
    if number % 5 == 0:
        store.save(robot(number), events(number), tick=number)
    print(number, flush=True)
"""


def test_what_was_acknowledged_survives_kill(tmp_path: Path) -> None:
    """A process killed at any moment has lost nothing that it said is written, and at most one more is there."""
    path = tmp_path / "robot.sqlite"
    for stop in (1, 7, 23):
        path.unlink(missing_ok=True)
        command = [sys.executable, "-c", WRITER, str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            for line in process.stdout:
                if int(line) == stop:
                    process.send_signal(signal.SIGKILL)
                    break
            said = [stop, *(int(line) for line in process.stdout if line.endswith("\n"))][-1]
        store = open_store(path)
        numbers = [record.nonce for record, _ in read_stored_robot(path).matings]
        assert numbers in (list(range(said + 1)), list(range(said + 2)))
        tick = see(store).tick
        assert tick in (said - said % 5, said + 1)
        since = [record.nonce for record, _ in store.decisions_since()]
        assert since == [number for number in numbers if number > tick]
        store.close()


@pytest.mark.parametrize("limit", ["file size", "pages"])
def test_a_full_disk_is_said_and_nothing_is_half_written(tmp_path: Path, limit: str) -> None:
    """The robot goes on without; once there is room again it writes as ever."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 1)
    before = see(store)
    if limit == "file size":
        with room_for(path.with_name(path.name + "-wal").stat().st_size):
            for number in (2, 3):
                with pytest.raises(StorageFullError, match="not written"):
                    mate(store, number)
    else:
        store._connection.execute("PRAGMA max_page_count = 1")
        with pytest.raises(StorageFullError, match="full"):
            store.save({"arrays": {"weights": np.ones(9000)}}, [], tick=9)
        store._connection.execute("PRAGMA max_page_count = 1000000")
    assert see(store) == before
    mate(store, 4)
    store.save(robot(4), events(4), tick=4)
    store.close()
    store = open_store(path)
    assert [record.nonce for record, _ in see(store).matings] == [1, 4]
    store.close()


def test_a_locked_file_is_like_a_full_disk(tmp_path: Path) -> None:
    """Somebody who keeps the file locked costs the robot a mating, not its life."""
    path = tmp_path / "robot.sqlite"
    store = RobotStore(path, ME, SCHEMA, busy_s=0.01, durable=False)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StorageFullError, match="locked"):
        mate(store, 1)
    other.execute("ROLLBACK")
    other.close()
    record = mate(store, 1)
    assert [seen for seen, _ in store.decisions_since()] == [record]
    store.close()


class FailingSync:
    """A connection whose commit says that the disk could not be synced, after it has written."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    def execute(self, statement: str, *values: Any) -> sqlite3.Cursor:
        cursor = self._connection.execute(statement, *values)
        if statement == "COMMIT":
            error = sqlite3.OperationalError("disk I/O error")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR_FSYNC
            raise error
        return cursor


def test_after_a_failed_sync_nothing_more_is_written(tmp_path: Path) -> None:
    """Nobody knows what is on the disk, so the memory stays broken until it is opened again, and then says what is."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    whole = store._connection
    store._database = FailingSync(whole)  # type: ignore[assignment]
    with pytest.raises(FatalStorageError, match="disk I/O error"):
        mate(store, 1)
    store._database = whole
    with pytest.raises(FatalStorageError, match="start again"):
        mate(store, 2)
    store.close()
    store = open_store(path)
    assert [record.nonce for record, _ in store.decisions_since()] == [1]
    store.close()


def test_a_memory_is_for_one_process(tmp_path: Path) -> None:
    """A second one is refused, also in another process; when the first has closed it, twice even, it is free."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    with pytest.raises(StorageError, match=r"robot\.sqlite: in use by another process"):
        open_store(path)
    command = [sys.executable, "-c", WRITER, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "in use by another process" in done.stderr.splitlines()[-1]
    store.close()
    store.close()
    open_store(path).close()


def test_another_robots_memory_or_another_schemas_is_refused(tmp_path: Path) -> None:
    """Both are named, and the memory stays as it was."""
    path = tmp_path / "robot.sqlite"
    open_store(path).close()
    with pytest.raises(StorageError, match="the file of robot 6d6d6d6d, not of 6f6f6f6f"):
        RobotStore(path, OTHER, SCHEMA)
    with pytest.raises(StorageError, match="another schema"):
        RobotStore(path, ME, bytes(16))
    open_store(path).close()


def test_what_is_no_memory_is_refused_and_left_alone(tmp_path: Path) -> None:
    """A text, a folder, somebody else's database, and a place that does not exist: named in one line."""
    text, foreign = tmp_path / "text", tmp_path / "foreign"
    text.write_text("no database at all " * 100)
    database = sqlite3.connect(foreign)
    database.execute("CREATE TABLE mine (precious TEXT)")
    database.close()
    for path in (text, foreign, tmp_path, tmp_path / "no" / "where"):
        content = path.read_bytes() if path.is_file() else b""
        for use in (open_store, read_stored_robot):
            with pytest.raises(StorageError) as refused:
                use(path)
            assert str(refused.value).startswith(f"{path}: ")
            assert "\n" not in str(refused.value)
        assert not path.is_file() or path.read_bytes() == content


def test_a_newer_memory_is_refused(tmp_path: Path) -> None:
    """By an older program, in a line that says what to do."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store._connection.execute("PRAGMA user_version = 99")
    store.close()
    for use in (open_store, read_stored_robot):
        with pytest.raises(StorageError, match=r"newer crcolony \(version 99\); update"):
            use(path)


def test_an_older_memory_is_brought_to_the_present(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With all that is in it; whoever only reads it leaves it as it is; a damaged one is refused before."""
    path, damaged = tmp_path / "robot.sqlite", tmp_path / "damaged.sqlite"
    store = open_store(path)
    mate(store, 1)
    store.save(robot(1), events(1), tick=1)
    mate(store, 2)
    before = see(store)
    store.close()
    damaged.write_bytes(path.read_bytes())
    database = sqlite3.connect(damaged)
    database.execute("UPDATE encounters SET energy = 1.0 WHERE seq = 2")
    database.commit()
    database.close()
    later = "ALTER TABLE encounters ADD COLUMN mood TEXT NOT NULL DEFAULT 'good';"
    monkeypatch.setattr(robot_schema, "MIGRATIONS", (*robot_schema.MIGRATIONS, later))
    content = path.read_bytes()
    assert tuple(read_stored_robot(path).matings) == before.matings
    assert path.read_bytes() == content
    with pytest.raises(StorageError, match="row 2 of table encounters is damaged"):
        open_store(damaged)
    for _ in range(2):
        store = open_store(path)
        assert see(store) == before
        store.close()


OF_VERSION_1 = (
    r"c-rlpUuYaf7{GV$@?X>B!O{l*WTMt<Ws^2ZskRSl(#9B*OVW5z3x%+`oy)D+o4M}H<r-"
    r"SCsV#_5#cCBFMFr`DU{Mi7L?2pw(6{2F_#lcRR1xt(so(7G?QZTae^60`?{{~5o0*+&zWL_+zS+Gj`^e!5TT+taZ"
    r"o!mfQ0vrmU3-8KP1BO_Y0@GZf=>lK_-F@b(nqxVB(=V*-"
    r"rjyxYi#&gYqy%;Yfm+ugIxqckpF<Ew>LI#>+aUiJ|)e0hYDsEMV?C$?lc{o85zoqkj&8V#0UwC$<8(sAgF7b4jG%"
    r"wjEs)Vkm;GR^w7)^GCp#|AicfBmL$&|OAym>h|EJ?Et`T^G;3SbBBdgc9Exp0q-"
    r"!!^W~I$pC|lau#ZdC(REA8>PD~h4wYf-HZM|0qUC%Q6IEW}vgNU#VU7`&1uiFUP<awDCOtxG(PUfjgNf|bw1eecq"
    r"Nroq;hO4^tC72|er`g3Kx0yUZTxwd%24!332`d$f%Y6<vtx%X{FHlh>&8ysXdPhU^wyrMy%nomAe0}_F<ElvsG>y"
    r";5u{Eco-yj1988k>=U!SKGFG;chv$|QEFWSr^nUTjc)r0qk?wCRlo+DW|%N@>^`+_f+VaeU)P|Q5Hmh0LO#H6VZ<"
    r"^r8Ivx}Rs)3ZF$ysf84zp%@<6U*`vlhhT_UUId)!t%}7jBL(oHnXK|!Vqh11MPj6u~ig+Hw_MuJUy<4WXni`OGS}"
    r"0i&jer4{+=pUEA5g=HRQ59tMF>1No%r@*)?e6Uy;Mzh(e{oOmk%68*4M-"
    r"N$0Up>@3=(gi}=8}@;iZQvaaGcvt2<r>03R*)$S(1;endaws4XOKETmO0N|*bOBy&a!m9d{Ni6t1Ou1OhOt88}Tx"
    r"m18)SAtuZg^0H~*;)}KMDU!$hov88lqFJ+c(GLnNdAouMJrNG!Eqi(D#qoywEC06HhP`qw7g5K4Dg4QWPguTGPat"
    r"@U;W`FJ$^QJ1VwTyCoV&~#wz-=usv;;d9D4B;C^*jW!Y?NZ*u!Us;F&BA7q*Bi11>$8@&Vp`A43-"
    r"|D(xe?N4KTS7WIUG>Mb~BvG53W@wwEG(WAn@ToTHqnrY4)W9m}^Isa46hYcT({Jqk&Sp~#xXtDHU71~Px4Zjaug2"
    r"*;bu;svG#ZsuS<yw26&MSKNZy}BCp`lj)v(~s4_hU;d}$T+i;V~1x)$j(^q2&2^S;@<F+#x6hO4knwnjrQmotOWG"
    r"9I0k-A=ggAi-rsXkdY$W!_SLmgi#p>t+ogNU+OzFmx-QTHEDQcNu_{gbWw8|PCs8j5S7&H2L^;m|tu*nb!xqLGiB"
    r"`b+Trlf|jLJ5?p@Jj`exaP)Z?JJ5hW4<+&%;!PNt6l|&5+?-xz-"
    r"8Os%VSat9gaRRMtH&VzjK(tScfAABYH!tem(RWKR&!5Px7L$e2;w!f6`xU1wx!X@^z65+DrXp29^kNRYAElhA9OJ"
    r"Oqs&pPC_jsp8_EiM?=Br-ZT9SoPtb%tW>}msJ+nV6H$c%)aMO;QBewk2w>YIC&tCjb$F1n$3`zsmI0+wW*8vju$j"
    r"|BM5>Z2!bF8f*=U;Z^7EqMnczH48z!Gt^X2LB)@A&T>j<Tj<?RFKRjA`{fqaF{llq~pZ)x>_2uY0PdxYWgH1yw{p"
    r"yFW_sgXnpImLaLG1nQ`F7|sv8AMSq+o*}2!bF8f*=TjApayQyA#{BbXwQDZ`Jj!Mwf9*OHgCnvuFL+M%Tp6iSRy-"
    r"%H30mWP$D;NK{dz)U7QwgFA)p_^JH%_@&n-PF}lwtmmUwI#(XmJ&jwtZ*C1VZf<Qcba-"
    r"u~(MBU`4(~w;ZedA)y8U_;p1L)q6?O0bbnMRa@UE_Jt1`Su{?vUcz2*B?OD)3(%a=N@-"
    r"J_03bTF;s1K1!4f*=TjAP9mW2=Wgw)}(&*(Et9A9EnjSskQZQ|M=kj|G(o+t>a7BAP9mW2!bF8f*=U;-"
    r"?1mrq_y@KMyBL4YE3Os_rk?!U)S{H^@cyLUU~P}Lg&kk_ch-*c`~I#i>-"
    r"GVhiq!S^oH8%+8gS=f*)@CasS=<hHvgYe8;c1pX=;W*Z=yK&oy`>2!bF8f*=TjAjtoN(|ZyvT5E%TX24i%{M}AWk"
    r"0%>?gSsBAyl{NwdO(YIljc$(`&e;V*E+Rx!BLg(7bj=a(?@h|Njs6UsK~mh10;2_)Sog)D#u;*fWkR-"
    r"!@eqi&~yZaa*;QS6#m}XKWOYS$dlx+)3$O^J)qMy)kFRC>2W>Ln_NARbAhrgvEiTcp2lAp*7SIz_w;@pUi;wtig("
    r"Q7sjbgk=${;Y`TU8C!yWYepQe*KYy"
)
"""A memory that the first version wrote, compressed; it stays as it is, whatever becomes of the present version."""


def test_a_memory_of_the_first_version_is_read(tmp_path: Path) -> None:
    """A file that was written then, not one that the present program makes."""
    path = tmp_path / "robot.sqlite"
    path.write_bytes(zlib.decompress(base64.b85decode(OF_VERSION_1)))
    store = open_store(path)
    assert store.load() == ({"generation": 1}, 1)
    assert store.decisions_since() == [(proposed(1), decision(1))]
    assert store.open_records() == [proposed(1), answered(2)]
    assert read_stored_robot(path).events == events(1)
    assert store.begin_incarnation(5) == 1001
    store.close()


@pytest.mark.parametrize("what", ["folder", "file"])
def test_a_place_that_may_not_be_written_is_refused(tmp_path: Path, what: str) -> None:
    """A folder or a file. Root may write anywhere, so the attempt is made by nobody, in a process of its own."""
    open_store(tmp_path / "robot.sqlite").close()
    (tmp_path / "robot.sqlite.lock").chmod(0o666)
    (tmp_path / "robot.sqlite").chmod(0o444)
    tmp_path.chmod(0o555 if what == "folder" else 0o777)
    name = "new.sqlite" if what == "folder" else "robot.sqlite"
    script = f"""
import os
from pathlib import Path
from tests.support.robot_stores import *
os.chdir({str(tmp_path)!r})
if os.getuid() == 0:
    os.setuid(65534)
open_store(Path({name!r}))
"""
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    tmp_path.chmod(0o755)
    assert f"StorageError: {name}: cannot be" in done.stderr.splitlines()[-1]


def test_an_analyst_reads_it_with_sql(tmp_path: Path) -> None:
    """While the robot lives; what they add (a view, an index) does not matter to the robot."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 4)
    store.save(robot(1), events(1), tick=1)
    with sqlite3.connect(path) as database:
        query = "SELECT initiator, responder, state, energy, conceived FROM encounters"
        assert database.execute(query).fetchall() == [(ME.hex(), PEER.hex(), "decided", 4 / 7, 1)]
        kinds = database.execute("SELECT seq, tick, kind FROM events").fetchall()
        assert kinds == [(1, 1, "Died"), (2, 1, "TurnedOver")]
        database.execute("CREATE VIEW conceptions AS SELECT * FROM encounters WHERE conceived")
        database.execute("CREATE INDEX mine ON encounters (energy)")
    database.close()
    store.close()
    open_store(path).close()


class AgainstAModel(RuleBasedStateMachine):
    """A memory that is written, closed, killed and damaged, beside lists that are not."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / "robot.sqlite"
        self.store = open_store(self.path)
        self.records: dict[Any, EncounterRecord] = {}
        self.decisions: dict[Any, Decision] = {}
        self.snapshots: list[tuple[int, int, list[Event]]] = []
        """Number, decisions before it, events before it; the newest last"""
        self.number = 0

    @rule(is_ours=st.booleans(), peer=st.sampled_from([PEER, OTHER]))
    def meet(self, is_ours: bool, peer: bytes) -> None:
        self.number += 1
        if is_ours:
            record = proposed(self.number, peer=peer)
            self._write([record], record)
        else:
            self._write([answered(self.number, peer=peer)])

    @rule(state=st.sampled_from(["mated", "aborted"]), data=st.data())
    @precondition(lambda self: any(self._open()))
    def close_encounter(self, state: Any, data: st.DataObject) -> None:
        record = data.draw(st.sampled_from(self._open()))
        is_mated = record.state == "decided" or state == "mated"
        closed = replace(record, state="mated" if is_mated else "aborted")
        is_new = is_mated and closed.encounter not in self.decisions
        self._write([closed], closed if is_new else None)

    @rule(data=st.data())
    @precondition(lambda self: any(self._open()))
    def orphan(self, data: st.DataObject) -> None:
        self._write([replace(data.draw(st.sampled_from(self._open())), orphaned=True)])

    def _open(self) -> list[EncounterRecord]:
        return [r for r in self.records.values() if r.state in ("decided", "prepared")]

    def _write(
        self, records: list[EncounterRecord], decided: EncounterRecord | None = None
    ) -> None:
        made = decision(self.number) if decided else None
        self.store.write(records, decided, made)
        self.records |= {record.encounter: record for record in records}
        if decided and made:
            self.decisions[decided.encounter] = made

    @rule()
    def save(self) -> None:
        self.number += 1
        message = self.snapshots[-1][2] if self.snapshots else []
        self.store.save(robot(self.number), events(self.number), tick=self.number)
        saved = (self.number, len(self.decisions), message + events(self.number))
        self.snapshots = [*self.snapshots[-1:], saved]

    @rule()
    def restart(self) -> None:
        self.store.close()
        self.store = open_store(self.path)

    @rule()
    def be_killed(self) -> None:
        """Go on from copies of the files as they are."""
        copy = self.path.with_name(f"{self.number}-{os.urandom(4).hex()}.sqlite")
        for suffix in ("", "-wal"):
            source = self.path.with_name(self.path.name + suffix)
            copy.with_name(copy.name + suffix).write_bytes(source.read_bytes())
        self.store.close()
        self.path = copy
        self.store = open_store(copy)

    @rule()
    @precondition(lambda self: len(self.snapshots) == 2)
    def lose_newest_snapshot(self) -> None:
        newest = "(SELECT newest FROM head)"
        query = f"UPDATE snapshots SET robot = x'01' WHERE serial = {newest}"
        self.store._connection.execute(query)
        self.snapshots.pop()
        self.restart()

    @invariant()
    def they_are_equal(self) -> None:
        seen = see(self.store)
        number, decided, message = self.snapshots[-1] if self.snapshots else (None, 0, [])
        assert seen.tick == number
        assert list(seen.events) == message
        known = [(record, self.decisions.get(e)) for e, record in self.records.items()]
        assert list(seen.matings) == known
        late = list(self.decisions.items())[decided:]
        assert list(seen.since) == [(self.records[e], made) for e, made in late]
        assert list(seen.open) == self._open()

    def teardown(self) -> None:
        self.store.close()
        self.folder.cleanup()


TestAgainstAModel = AgainstAModel.TestCase
TestAgainstAModel.settings = settings(max_examples=30, stateful_step_count=25, deadline=None)
