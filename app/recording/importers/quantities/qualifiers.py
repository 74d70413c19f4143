"""Words next to a quantity in a column's name: harmless, of another quantity, or open."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

from dearig.recording.importers.quantities.units import unit_of

__all__ = ["COMPRESSIVE", "SHEAR", "TRUE", "is_harmful", "is_harmless", "qualifier_in"]


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


#: Words after which a quantity is not the one that was measured along the film, or not in time.
#: Without accents and in small letters, as all words here.
_HARMFUL = _set(
    """desired demand demanded reference ref command commanded cmd simulated simulation sim
    predicted prediction estimated estimate expected calculated computed theoretical theory ideal
    planned programmed target setpoint set soll sollwert consigne fit fitted model modelled modeled
    max maximum maximal min minimum minimal peak crest amplitude rms mean mittel mittelwert moyen
    moyenne median std sdev stddev deviation error lateral transverse transversal quer radial
    circumferential hoop shear schub scher cisaillement flexure flexural bending biege torsion
    torsional static dynamic statisch dynamisch residual plastic plastisch elastic friction reib
    normal blocked blocking yield ultimate break fracture bruch rupture offset drift noise
    rauschen difference envelope onset spitzen spitze maximale pk pp sp sd eff avg squared
    response rise fall settling dwell exposure integration latency remaining"""
)
#: Words of shear, which no model here describes.
SHEAR = _set("shear schub scher cisaillement")
#: Words of a strain and a stress that refer to the film as it is strained.
TRUE = _set("true wahre vraie cauchy hencky logarithmic")
#: Words of compression, whose readings testing machines write as positive numbers.
COMPRESSIVE = _set("compressive compression compressif druck stauch stauchung")
#: Words that leave a quantity as it is: who measured it, with what, and where.
_HARMLESS = _set(
    """measured gemessen gemessene mesure mesuree actual aktuelle ist istwert real reel reelle raw
    roh sensed read reading feedback fbk recorded logged sampled tensile zug traction engineering
    technical technische axial axiale longitudinal langs uniaxial uniaxiale standard total gesamt
    applied angelegte angelegt film membrane sample specimen probe proben prufling eprouvette
    sensor sensors transducer optical optische optisch amplifier amp verstarker high hoch power
    supply output out outp ausgang sortie input eingang entree channel chan kanal voie card karte
    analog analogue digital mon primary main first machine maschine maschinen grip clamp
    extensometer aufnehmer video dic test pruf run mess messung measurement mesures elapsed
    relative relativ absolute absolut corrected korrigiert calibrated kalibriert zeroed tared
    smoothed filtered gefiltert tip end free actuator aktor dea vertical vertikal signal value
    values data daten wert device dev cdaq pxi slot mod module instrument unit cell sense the of
    and for across over with from electrode electric electrical elektrische drive driving
    excitation time since trek keyence keithley keysight agilent tektronix rigol yokogawa
    fluke matsusada spellman ultravolt hamamatsu philtec polytec omron panasonic epsilon micro
    optoncdt instron zwick mts linkam futek daq rig lab messwert col column spalte
    grad deg percent prozent trace curve series waveform left right top bottom front back
    dose axis kraftaufnehmer wegaufnehmer links rechts oben unten traversen querhaupt kolben
    zylinder verfahr dehn fein techn versuchs"""
)
#: Words that are harmless before some quantities only.
_HARMLESS_FOR = MappingProxyType(
    {
        "voltage": _set("command commanded cmd"),
        "nominal_stress": _set("nominal nenn pk piola"),
        "strain": _set("nominal nenn nominelle"),
        "stretch": _set("nominal nenn nominelle"),
    }
)
#: Quantities whose names have any words before them: room temperature, test time. Words that make
#: something else of them count in any case.
_FREE = _set("time temperature")
#: Letters of a word that counts: shorter ones are numbers of channels and axes.
_SHORT = 2
#: The same in Chinese and Japanese names, which have no blanks.
_EAST_ASIAN = _set(
    """最大 最小 目标 目標 设定 設定 指令 剪切 せん断 横向 残余 残留 屈服 降伏 理论 理論 参考 峰值
    振幅 平均 动态 動的 弯曲 曲げ 预测 予測"""
)


def qualifier_in(quantity: str, words: Sequence[str], at: int) -> str:
    """Return the word of a name that leaves open whether it is ``quantity``, or "".

    ``words`` are those of the name without accents and in small letters, ``at`` is the place of
    the one that names the quantity. Every other one has to be known as harmless.
    """
    own = _HARMLESS_FOR.get(quantity, frozenset())
    for place, word in enumerate(words):
        if place == at or not word or word in own or word in COMPRESSIVE | TRUE:
            continue
        if is_harmful(word):
            return word
        if quantity not in _FREE and not is_harmless(word):
            return word
    return ""


def is_harmful(word: str) -> bool:
    """Return True if ``word`` says that a column is not what was measured, or not in time."""
    return word in _HARMFUL or any(part in word for part in _EAST_ASIAN)


def is_harmless(word: str) -> bool:
    """Return True if ``word`` in a name does not change which quantity the name means."""
    return len(word) <= _SHORT or word in _HARMLESS or unit_of(word) is not None
