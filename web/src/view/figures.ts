import { decimal, significant } from "./format";

/** A value of a person that is always on screen. */
export interface Figure {
  /** The family of the feature that computes it, and the channel. */
  family: string;
  channel: string;
  /** The everyday name of the value. */
  word: string;
  unit: string;
  write: (value: number) => string;
  /** The measure of the feature `state` that compares the value with the baseline; empty if there is none. */
  measure: string;
  decimals: number;
  /** An additional count, with its unit. */
  beside?: { channel: string; unit: string };
}

const rate = (value: number) => decimal(value);

/** THE table of the values of a person, in the order shown; of the rows with the same word, the first one with a value is shown. */
export const FIGURES: readonly Figure[] = [
  { family: "heart", channel: "ECG_Rate_Mean", word: "Heart", unit: "/min", write: rate, measure: "heart_rate", decimals: 0 },
  { family: "intervals", channel: "HRV_MeanHR", word: "Heart", unit: "/min", write: rate, measure: "heart_rate", decimals: 0 },
  { family: "pulse", channel: "PPG_Rate_Mean", word: "Pulse", unit: "/min", write: rate, measure: "", decimals: 0 },
  { family: "view", channel: "RPPG_Rate", word: "Pulse", unit: "/min", write: rate, measure: "", decimals: 0 },
  { family: "breath", channel: "RSP_Rate_Mean", word: "Breath", unit: "/min", write: rate, measure: "breathing_rate", decimals: 0 },
  {
    family: "skin", channel: "EDA_Tonic_Mean", word: "Skin", unit: "µS", write: (value) => decimal(value, 2),
    measure: "skin_level", decimals: 2, beside: { channel: "SCR_Peaks_Rate", unit: "SCR/min" },
  },
  { family: "brain", channel: "EEG_ThetaAlpha", word: "Brain θ/α", unit: "ratio", write: (value) => decimal(value, 2), measure: "", decimals: 2 },
  { family: "input", channel: "input_rate", word: "Keys", unit: "/min", write: rate, measure: "input_rate", decimals: 0 },
  { family: "voice", channel: "VOICE_Activity", word: "Speaks", unit: "%", write: (value) => decimal(100 * value), measure: "", decimals: 0 },
  { family: "face", channel: "BLINK_Rate", word: "Blinks", unit: "/min", write: rate, measure: "", decimals: 0 },
  { family: "muscle", channel: "EMG_RMS", word: "Muscle", unit: "µV", write: significant, measure: "", decimals: 0 },
  { family: "skin_temperature", channel: "TEMP_Mean", word: "Skin temp", unit: "°C", write: (value) => decimal(value, 1), measure: "", decimals: 1 },
  { family: "movement", channel: "ACC_ENMO", word: "Movement", unit: "g", write: (value) => decimal(value, 3), measure: "", decimals: 3 },
];

/** The number of figures that fit on a wide tile. */
export const MOST_FIGURES = 6;
