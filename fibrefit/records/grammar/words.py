"""Words for time, force, position, drive and angle in headings, in the languages loggers are set to."""

from __future__ import annotations

import itertools
import re
import unicodedata

from fibrefit.core.declarations import ROLES
from fibrefit.core.units import KINDS

#: Kind of quantity each role is.
KIND_OF_ROLE = {role: KINDS[si] for role, si in ROLES.items()}


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: Stems that name a role wherever they stand in a word: Seilkraft, Pruefzeit, Standardweg.
_STEMS = {
    "time": _words("zeit timestamp elapsed времен 时间 時間 時刻"),
    "force": _words("kraft force loadcell zatizeni effort fuerza forza forca kracht усили нагрузк 荷重 拉力 载荷"),
    "position": _words("position displac extens verschieb poloh auslenk vychylk prodlouz deplacement allongement")
    | _words("desplaz spostam verplaats przemieszcz posicion posizion deslocam перемещ положен 位移 変位 位置"),
    "velocity": _words("velocity geschwindigkeit rychlost vitesse velocidad velocita snelheid predkosc скорост 速度"),
    "drive": _words("antrieb pohon actuator aktuator привод"),
    "angle": _words("angle winkel uhel rotation angolo angulo угол 角度"),
}

#: Whole words.
_WORDS = {
    "time": _words(
        "time stamp stamps cas datum date uhrzeit t clock doba epoch unix utc micros millis temps tiempo tempo czas"
    )
    | _words("datetime tid tijd secs seconds sekunden zaman aika ido время"),
    "force": _words("load sila sily silu last tension tah f fn fz gauge sila carga carico charge kraft сила 力"),
    "position": _words("weg disp travel stroke draha posun hub zdvih draha drahy drogi zdvihu lvdt traverse")
    | _words("crosshead u pos droga corsa course way ход путь"),
    "velocity": _words("speed v vel rpm"),
    "drive": _words("aktor drive motor excitation anregung buzeni stellweg"),
    "angle": _words("phi alpha tilt natoceni"),
}

#: Words that tell a wanted or derived signal from a measured one.
_WANTED = _words(
    "soll sollwert setpoint command commanded cmd target reference ref zadana desired demand demanded nominal"
)
_WANTED |= _words("consigne consigna vorgabe")

#: Beginnings of words for a reading that nothing was done to, and for one that was filtered, smoothed or calibrated.
_RAW = tuple(
    _words("raw roh unfilt ungefilt unsmooth ungeglatt uncal unkal unproc brut crud grezz surov surow nefiltr niefiltr")
    | _words("nonfiltr ongefilt ofiltr ruw untreated unbehandelt сыр необраб нефильтр")
)
_PROCESSED = tuple(
    _words("filt gefilt lowpass highpass bandpass tiefpass hochpass passebas passabass pasobaj dolnoprop dolnoprzep")
    | _words("smooth geglatt glatt liss suaviz levig vyhlaz wygladz avg averag gemitt mittel moyen promed mediat mean")
    | _words("median prumer sredni usredn gleitend moving rolling savgol butterw bessel kalman denois entrausch calib")
    | _words("kalib etalonn tarat corr korr compens kompens detrend resampl interpol decim process verarbeit trait")
    | _words("procesad elaborat zpracovan przetworz condition фильтр сглаж калибр")
)
_PROCESSED_WORDS = _words("cal kal lp lpf hpf bpf flt sm comp proc")

#: Names that many give a position, and others to something else: signs of an axis or of a way, and sensors of one.
_MAY_BE_WAY = _words("x y z s h w d dx dy dz dl displ dist distance abstand laser laserabstand lage konum laage")
_MAY_BE_WAY |= _words("vzdalenost odleglosc distanza distancia distancja avstand etaisyys hohe height level hauteur")

#: Words that tell what goes with a quantity from the quantity itself.
_BESIDE = _words(
    "error errors err uncertainty uncertainties std stdev sigma deviation fehler abweichung chyba odchylka"
)
_BESIDE |= _words("regelabweichung")

#: Words that tell one number of many readings, a bound or a step from the readings. A mean is a reading of its own.
_STATISTIC = _words(
    "max maxi maximum maximal min mini minimum minimal peak pk fmax fmin xmax xmin rms amplitude schlepp"
)
_STATISTIC |= _words("spitze spitzen spitzenwert hold")
_BOUND = _words("limit limits limite limiet grenze grenzwert grenzkraft threshold schwelle")
_STEP = _words("increment increments inkrement zuwachs")

#: A reading without its sign, or multiplied by itself.
_WITHOUT_SIGN = re.compile(r"^\s*\|[^|]+\||(?<![^\W_])(?:abs\s*\(|betrag(?![^\W_]))|[^\W\d_]\s*(?:\^\s*2|\u00b2)", re.I)

#: Words for what is repeated in a test, and counted.
_REPETITIONS = _words("cycle cycles count counts zyklus zyklen cyklus cykly ciclo ciclos cicli steps turns")

#: Names of a column that only counts rows.
_COUNTERS = _words("no nr index idx sample samples scan point pt row n zeile bod cislo lfdnr record id i vzorek")
_COUNTERS |= _words("sequence seq counter nummer number num lp messpunkt messwert punkt ligne muestra")

#: Names of a column of remarks, which may be empty throughout.
_REMARKS = _words(
    "comment comments kommentar bemerkung bemerkungen poznamka remark remarks marker event events"
) | _words("note notes info status hinweis")


def tokens(text: str) -> list[str]:
    """Words of a heading in lower case, without accents, split at signs, digits and changes of case.

    Parameters
    ----------
    text : str
        A heading, e.g. ``"F_Seil"`` or ``"Síla v laně"``.

    Returns
    -------
    list of str
        E.g. ``["f", "seil"]``.
    """
    bare = "".join(c for c in unicodedata.normalize("NFD", text) if not unicodedata.combining(c)).replace("ß", "ss")
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", bare).replace("ł", "l")
    return re.findall(r"[^\W\d_]+", spaced.casefold())


def score(text: str, role: str) -> int:
    """How clearly a heading names a role: 0 not at all, 1 by a letter, 3 by a word; less for a wanted value.

    Parameters
    ----------
    text : str
        Heading without its unit.
    role : str
        One of `ROLES`.

    Returns
    -------
    int
        Points.
    """
    role = role.split("_")[0]
    words = tokens(text)
    points = 0
    for word in words:
        if role == "time" and word == "elapsed" and not _REPETITIONS.isdisjoint(words):
            continue  # so many cycles, and no time
        if any(stem in word for stem in _STEMS[role]):
            points = max(points, 3)
        elif word in _WORDS[role] or (role == "position" and word.endswith("weg")):
            points = max(points, 1 if len(word) == 1 else 3)
    return max(points - 2, 0) if any(word in _WANTED or word in _BESIDE for word in words) else points


#: What goes with a quantity as a column of its own: it is no loss where another quantity is read alone.
GO_BESIDE = ("an error", "a wanted value")


def is_no_reading(text: str) -> str:
    """What a heading says its column is in place of a reading: a wanted value, a statistic, or nothing of the kind.

    Parameters
    ----------
    text : str
        Heading without its unit.
    """
    words = set(tokens(text))
    called = dict(zip(GO_BESIDE, (_BESIDE, _WANTED), strict=True))
    called |= {"a limit": _BOUND, "an increment": _STEP, "a statistic": _STATISTIC}
    found = next((kind for kind, names in called.items() if not words.isdisjoint(names)), "")
    return found or ("a size without its sign" if _WITHOUT_SIGN.search(text) else "")


def treated(text: str) -> str:
    """What a heading says was done to a reading: "processed", nothing ("raw"), or empty where it says neither.

    Parameters
    ----------
    text : str
        Heading without its unit.
    """
    words = tokens(text)
    without = any(word.startswith("filtr") for word in words) and not {"sin", "sem", "non"}.isdisjoint(words)
    if without or any(word.startswith(_RAW) and not word.startswith("rohr") for word in words):
        return "raw"
    words += [first + second for first, second in itertools.pairwise(words)]  # "low pass"
    return "processed" if any(w.startswith(_PROCESSED) or w in _PROCESSED_WORDS for w in words) else ""


def kinds_named(text: str) -> set[str]:
    """Kinds of quantity the words of a heading stand for.

    Parameters
    ----------
    text : str
        Heading without its unit.

    Returns
    -------
    set of str
        Of ``"time"``, ``"force"``, ``"length"`` and ``"angle"``.
    """
    return {KIND_OF_ROLE[role] for role in ("time", "force", "position", "drive", "angle") if score(text, role) > 0}


def may_be_way(text: str) -> bool:
    """Whether a heading is one that a position may have, and tells nothing else: a sign such as ``x``, or a sensor."""
    found = tokens(text)
    return bool(found) and _MAY_BE_WAY.issuperset(found)


def counts_rows(text: str) -> bool:
    """Whether a heading is that of a column that numbers the rows."""
    found = tokens(text)
    return text.strip() == "#" or (len(found) > 0 and _COUNTERS.issuperset(found))


def is_remark(text: str) -> bool:
    """Whether a heading is that of a column of remarks."""
    return any(word in _REMARKS for word in tokens(text))
