"""Robots' files for tests: small records, decisions, robots and events, each distinguished by a number."""

import base64
import contextlib
import resource
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from crcolony.evolution.history import Died, Event, TurnedOver
from crcolony.protocol.encounters import EncounterRecord, EncounterState, Offer
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

ME, PEER, OTHER = b"m" * 16, b"p" * 16, b"o" * 16
SCHEMA = b"s" * 16


def open_store(path: Path, durable: bool = False) -> RobotStore:
    return RobotStore(path, ME, SCHEMA, durable=durable)


def proposed(number: int, state: EncounterState = "decided", peer: bytes = PEER) -> EncounterRecord:
    """Return the record of an encounter that this robot proposed."""
    return EncounterRecord(
        Encounter(ME, peer, 7, number),
        "initiator",
        state,
        number,
        number + 1,
        Offer(f"me/{number}", bytes([number % 256]) * 16),
        Offer(f"peer/{number}", bytes([number % 256]) * 16),
        b"a letter",
    )


def answered(
    number: int, state: EncounterState = "prepared", peer: bytes = PEER
) -> EncounterRecord:
    """Return the record of an encounter that another robot proposed."""
    encounter = Encounter(peer, ME, 7, number)
    return replace(proposed(number, state), encounter=encounter, role="responder")


def mate(store: RobotStore, number: int) -> EncounterRecord:
    """Write an encounter that this robot proposed, and the decision about it; return its record."""
    record = proposed(number)
    store.write([record], record, decision(number))
    return record


def decision(number: int) -> Decision:
    conceived = number % 3 > 0
    child = bytes([number % 256]) * 16 if conceived else b""
    return Decision(number / 7, conceived, number % 5 == 0, child, 10 * number, bytes(15) + b"s")


def robot(number: int) -> dict[str, Any]:
    """Return a value like that of `Robot.save`, a few pages long."""
    pool = [(np.full(2, float(number)), "me/1", "peer/1", number)]
    weights = np.random.default_rng(number).normal(size=700)
    return {
        "arrays": {"weights": weights},
        "generation": number,
        "subpopulation": {"pool": pool},
    }


def events(number: int) -> list[Event]:
    return [Died(number, 0, f"me/{number}"), TurnedOver(number, 0, number, 3)]


@dataclass(frozen=True)
class Seen:
    """All that a store returns, in a form that can be compared."""

    matings: tuple[tuple[EncounterRecord, Decision | None], ...]
    since: tuple[tuple[EncounterRecord, Decision], ...]
    open: tuple[EncounterRecord, ...]
    marks: tuple[tuple[bytes, tuple[tuple[int, int], bool]], ...]
    events: tuple[Event, ...]
    tick: int | None
    robot: bytes
    """The robot's weights"""


def see(store: RobotStore) -> Seen:
    loaded = store.load()
    stored = read_stored_robot(store.path)
    assert (None if loaded is None else loaded[1]) == stored.tick
    return Seen(
        tuple(stored.matings),
        tuple(store.decisions_since()),
        tuple(store.open_records()),
        tuple(store.marks().items()),
        tuple(stored.events),
        stored.tick,
        b"" if loaded is None else loaded[0]["arrays"]["weights"].tobytes(),
    )


@contextlib.contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond `size` bytes, as a full disk or a quota would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def write_version_1(path: Path) -> None:
    """Write the robot's file `FILE_OF_VERSION_1`."""
    path.write_bytes(zlib.decompress(base64.b85decode(FILE_OF_VERSION_1)))


FILE_OF_VERSION_1 = (
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
"""A robot's file that version 1 wrote, compressed; it must never change."""
