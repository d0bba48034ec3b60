//! Structs with fields that only the feature `research` makes public.

/// Declares a struct. All its fields are public with the feature `research`; without it, they have the declared
/// visibility, and other crates can neither construct the struct nor list its fields.
macro_rules! research_fields {
    (
        $(#[$about:meta])*
        pub struct $Struct:ident { $($(#[$field_about:meta])* $field_vis:vis $field:ident: $Field:ty,)* }
    ) => {
        #[cfg(feature = "research")]
        $(#[$about])*
        pub struct $Struct { $($(#[$field_about])* pub $field: $Field,)* }

        #[cfg(not(feature = "research"))]
        $(#[$about])*
        #[non_exhaustive]
        pub struct $Struct { $($(#[$field_about])* $field_vis $field: $Field,)* }
    };
}
