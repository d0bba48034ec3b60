//! Macros that declare parameters: one declaration gives a field, its check, its presets and its
//! [`ParamInfo`](super::ParamInfo).

/// Declares structs of parameters, and `TABLE` with their scalars. `at` is the path of a struct in
/// [`TeamParams`](super::TeamParams). After the value of the paper, `=>` gives the recommended one if it differs.
macro_rules! params {
    ($(
        $(#[$about:meta])*
        struct $Struct:ident at $at:tt {
            // Structs of parameters; optional ones are absent from the presets.
            $(parts { $($(#[$part_about:meta])* $part:ident: $Part:ident;)* })?
            $(optional { $($(#[$optional_about:meta])* $optional:ident: $Optional:ident;)* })?
            // Number [letters of the paper] = presets, unit, scenario key, range, range that depends on other fields.
            $(numbers { $(
                $(#[doc = $number_doc:literal])*
                $number:ident $([$($letter:literal),*])? = $number_paper:expr $(=> $number_recommended:expr)?,
                    $unit:literal, $number_key:literal, $allowed:expr $(, |$params:ident, $range:ident| $relation:expr)?;
            )* })?
            // Options: presets, scenario key.
            $(words { $(
                $(#[doc = $word_doc:literal])*
                $word:ident: $Word:ident = $word_paper:ident $(=> $word_recommended:ident)?, $word_key:literal;
            )* })?
            // Switches: presets, scenario key.
            $(flags { $(
                $(#[doc = $flag_doc:literal])*
                $flag:ident = $flag_paper:literal $(=> $flag_recommended:literal)?, $flag_key:literal;
            )* })?
            // Fields that are not in the table.
            $(others { $($(#[$other_about:meta])* $other:ident: $Other:ty = $value:expr;)* })?
            // Checks of relations between the structs in this one.
            $(relations |$self:ident, $errors:ident| $relations:block)?
        }
    )*) => {
        $(
            $(#[$about])*
            #[derive(Debug, Clone, Copy, PartialEq)]
            pub struct $Struct {
                $($($(#[$part_about])* pub $part: $Part,)*)?
                $($($(#[$optional_about])* pub $optional: Option<$Optional>,)*)?
                $($(
                    $(#[doc = $number_doc])*
                    #[doc = concat!(
                        "\n\nUnit: ", $unit, ". Range: `", stringify!($allowed), "`. Scenario key: `", $number_key,
                        "`. Paper: `", stringify!($number_paper), "`.", $(" Recommended: `", stringify!($number_recommended), "`.")?
                    )]
                    $($(#[doc(alias = $letter)])*)?
                    pub $number: f64,
                )*)?
                $($(
                    $(#[doc = $word_doc])*
                    #[doc = concat!("\n\nScenario key: `", $word_key, "`.")]
                    pub $word: $Word,
                )*)?
                $($(
                    $(#[doc = $flag_doc])*
                    #[doc = concat!("\n\nScenario key: `", $flag_key, "`.")]
                    pub $flag: bool,
                )*)?
                $($($(#[$other_about])* pub $other: $Other,)*)?
            }

            impl $Struct {
                /// Returns every parameter that is out of range, alone or in combination with others.
                pub fn out_of_range(&self) -> Vec<ParamError> {
                    let mut errors = errors_of([
                        $($((stringify!($part), self.$part.out_of_range()),)*)?
                        $($((
                            stringify!($optional),
                            self.$optional.as_ref().map($Optional::out_of_range).unwrap_or_default(),
                        ),)*)?
                    ]);
                    $($({
                        let allowed = $allowed;
                        $(let allowed = { let ($params, $range) = (self, allowed); $relation };)?
                        allowed.check(stringify!($number), self.$number, &mut errors);
                    })*)?
                    $({ let ($self, $errors) = (self, &mut errors); $relations })?
                    errors
                }

                /// Returns the recommended values, or those of the paper.
                fn preset(is_recommended: bool) -> Self {
                    Self {
                        $($($part: $Part::preset(is_recommended),)*)?
                        $($($optional: None,)*)?
                        $($($number: params!(@preset is_recommended, $number_paper $(, $number_recommended)?),)*)?
                        $($($word: params!(@preset is_recommended, $Word::$word_paper $(, $Word::$word_recommended)?),)*)?
                        $($($flag: params!(@preset is_recommended, $flag_paper $(, $flag_recommended)?),)*)?
                        $($($other: $value,)*)?
                    }
                }
            }
        )*

        /// Every scalar parameter, in the order of the declarations.
        static TABLE: &[ParamInfo] = &[$(
            $($(params!(@info $Struct $at $number, $number_key, concat!($($number_doc, "\n"),*),
                ParamKind::Number { unit: $unit, allowed: $allowed }),)*)?
            $($(params!(@info $Struct $at $word, $word_key, concat!($($word_doc, "\n"),*),
                ParamKind::Word($Word::WORDS)),)*)?
            $($(params!(@info $Struct $at $flag, $flag_key, concat!($($flag_doc, "\n"),*), ParamKind::Flag),)*)?
        )*];
    };
    (@preset $is_recommended:ident, $paper:expr) => {{
        _ = $is_recommended;
        $paper
    }};
    (@preset $is_recommended:ident, $paper:expr, $recommended:expr) => {
        if $is_recommended { $recommended } else { $paper }
    };
    (@info $Struct:ident [$($at:ident).*] $field:ident, $key:literal, $doc:expr, $kind:expr) => {
        ParamInfo {
            path: concat!($(stringify!($at), ".",)* stringify!($field)),
            key: $key,
            doc: $doc,
            kind: $kind,
            // A part is optional or not.
            get: |team| Some(Option::<&$Struct>::from(&(*team)$(.$at)*)?.$field.value()),
            set: |team, value| {
                Option::<&mut $Struct>::from(&mut (*team)$(.$at)*).is_some_and(|part| part.$field.set(value))
            },
        }
    };
}

/// Declares options: enums whose variants have words, which are used in scenario files.
macro_rules! words {
    ($(
        $(#[$about:meta])*
        enum $Name:ident { $($(#[doc = $doc:literal])* $Variant:ident = $word:literal,)* }
    )*) => {$(
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $Name { $($(#[doc = $doc])* $Variant,)* }

        impl $Name {
            pub(super) const WORDS: &'static [Word] = &[$(Word { word: $word, doc: concat!($($doc, "\n"),*) },)*];
        }

        impl Scalar for $Name {
            fn value(&self) -> ParamValue {
                ParamValue::Word(match self {
                    $(Self::$Variant => $word,)*
                })
            }

            fn set(&mut self, value: ParamValue) -> bool {
                *self = match value {
                    $(ParamValue::Word($word) => Self::$Variant,)*
                    _ => return false,
                };
                true
            }
        }
    )*};
}
